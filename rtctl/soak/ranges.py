"""Ranges of a soak for each machine, and the signals of its rows that the invariants use.

The ranges suit a bench: moves that the law can follow, and gains with a stability margin. They are in the profile of a
machine (machines/profile.py).
"""

from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.load import get_path
from rtctl.drivers import at_mio_16de, ldu_amplifier
from rtctl.machines import Machine
from rtctl.machines.base import DESCRIBED
from rtctl.machines.profile import AMPLIFIER, Range
from rtctl.machines.profiles import PROFILES, profile_of
from rtctl.soak.described import DESCRIBED_GAINS, described_counts, described_range, full_commands, rounding_of
from rtctl.tick.faults import CODES


def range_of(machine: Machine) -> Range:
    """Ranges for a machine's kind; for a described machine from its reference.

    Raises UserError where there are none.
    """
    if machine.kind == DESCRIBED:
        return described_range(machine.config)
    found = profile_of(machine.kind).range
    if found is None:
        raise UserError(f"no soak for machine '{machine.kind}'; it is for {', '.join(PROFILES)}")
    return found


def with_reference(config: Any) -> Any:
    """The config; with the default reference of its machine where it has none."""
    given = config.reference
    if given.steps or len(given.knots) > 1:
        return config
    return config.model_copy(update={"reference": given.model_copy(update={"knots": knots_of(config)})})


def knots_of(config: Any) -> list[tuple[float, float]]:
    """Knots of the default reference of a machine. Raises UserError for a described machine."""
    if config.kind == DESCRIBED:
        raise UserError(f"{config.name}: a soak moves as the reference does; give the config one")
    found = profile_of(config.kind).range
    assert found is not None
    return list(found.knots)


def gains_of(config: Any) -> dict[str, tuple[float, float]]:
    """Gains that the config's law uses, by path, each with its lowest and highest value in SI."""
    out = {}
    found = profile_of(config.kind).range
    for path, (low, high) in (found.gains if found is not None else DESCRIBED_GAINS).items():
        try:
            value = get_path(config, path)
        except UserError:  # a law of another kind
            continue
        if value:
            out[path] = (low * value, high * value)
    return out


def volts(config: Any) -> tuple[float, float]:
    """Lowest and highest output that law and converter allow, V, with half a code for rounding."""
    if config.kind == DESCRIBED:
        return full_commands(config)
    limit = config.law.limit
    low, high = (-limit.high if limit.low is None else limit.low), limit.high
    full = full_scale(config)
    half = full / 2 / CODES
    if profile_of(config.kind).has(AMPLIFIER):
        high, low = min(high, config.amplifier.limit), max(low, -config.amplifier.limit)
    return max(low, -full) - half, min(high, full) + half


def full_scale(config: Any) -> float:
    """Highest voltage of the converter."""
    output = profile_of(config.kind).output
    assert output is not None
    wire = output(config)
    return abs(float(wire.external_volts)) if wire.external_volts else at_mio_16de.INTERNAL_VOLTS


def rounding(config: Any) -> float:
    """Largest difference of a row's output from the law's, V.

    It allows half a code, one code at the end of the scale, and the compensation of a measured amplifier's knee.
    """
    if config.kind == DESCRIBED:
        return rounding_of(config)
    code = full_scale(config) / CODES
    amplifier = getattr(config, "amplifier", None)
    return 2 * code + (ldu_amplifier.KNEE_VOLTS if amplifier is not None and amplifier.compensate else 0.0)


def unknown(config: Any) -> set[str]:
    """Names of truth columns that stay empty: those without a state in a user's plant, and all with an FMU."""
    from rtctl.machines import own_plant

    if config.kind == DESCRIBED:
        return set()
    profile = profile_of(config.kind)
    columns = [column.name for column in profile.truth]
    parts = own_plant.parts_of(config)
    if parts is not None:
        fields = zip(columns, profile.plant.OWN.truth, strict=True)
        return {column for column, field in fields if field not in (parts.state.names or ())}
    return set(columns) if config.plant.fmu is not None else set()


def counts_per_unit(config: Any) -> float:
    """Counts per unit of the truth column; nan where the ratio is not known.

    A term of physics on the reading changes the ratio. So may a user's plant of a linear drive.
    """
    from rtctl.machines import own_plant
    from rtctl.plants.physics import TERMS

    if own_plant.is_own(config):
        if profile_of(config.kind).has(AMPLIFIER):
            return float("nan")
    elif any(TERMS[t.term].act_at("reading", config.kind) is not None for t in config.plant.physics):
        return float("nan")
    if config.kind == DESCRIBED:
        return described_counts(config)
    counts = profile_of(config.kind).counts
    assert counts is not None
    return counts(config)
