"""What a random day may ask of each machine, and where the invariants find their signals in its rows.

The ranges are those that a bench would allow: moves that the law follows, gains that leave it a margin. Whoever has a
machine with other bounds adds a row here.
"""

from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.config.load import get_path
from rtctl.drivers import at_mio_16de, ldu_amplifier
from rtctl.loop.faults import CODES
from rtctl.machines import Machine
from rtctl.machines.base import DESCRIBED
from rtctl.soak.described import DESCRIBED_GAINS, Range, described_counts, described_range, full_commands, rounding_of

RANGES = {
    "ivu": Range(
        position="capstan", error="capstan_error", outputs=("u1", "u2"), counts="capstan_counts",
        truth="truth_capstan", tensions=("tension1_estimate", "tension2_estimate"),
        truth_tensions=("truth_tension1", "truth_tension2"), travel=10.0, jump=4.0, rate=(0.5, 8.0), settle=2.0,
        tolerance=0.05, stretch=2.0, counters=1, inputs=2,
        gains={
            "law.position.gain": (0.7, 1.1), "law.position.tau_d": (0.8, 1.2), "law.shaper.bandwidth": (0.6, 1.0),
            "law.tension.F_t": (0.8, 2.0), "law.friction.motor1.tau_C": (0.8, 1.0),
        },
        measure=("radius.source", "measured"),
    ),
    "ldu": Range(
        position="position", error="position_error", outputs=("u",), counts="encoder_counts", truth="truth_x",
        tensions=(), truth_tensions=(), travel=0.15, jump=0.004, rate=(0.01, 0.06), settle=2.0, tolerance=1.5e-3,
        stretch=20.0, counters=2, inputs=0,
        gains={
            "law.position.gain": (0.7, 1.0), "law.position.velocity_gain": (0.9, 1.05),
            "law.position.tau_i": (1.0, 2.0), "law.shaper.bandwidth": (0.6, 1.0), "law.friction.F_c": (0.85, 1.0),
        },
    ),
    "axis": Range(
        position="x", error="position_error", outputs=("u",), counts="x_counts", truth="truth_x", tensions=(),
        truth_tensions=(), travel=0.3, jump=0.03, rate=(0.02, 0.3), settle=1.0, tolerance=2e-4, stretch=2.0,
        counters=1, inputs=0,
        gains={"law.position.gain": (0.6, 1.1), "law.position.velocity_gain": (0.8, 1.2)},
    ),
}  # fmt: skip

KNOTS = {  # (s, rad or m) from where it starts: played where the config has no reference of its own
    "ivu": [(0.0, 0.0), (0.2, 0.0), (0.2, 1.0), (2.0, 1.0), (2.0, 0.0), (4.0, 0.0), (5.0, -2.0), (6.0, 0.0)],
    "ldu": [(0.0, 0.0), (0.2, 0.0), (0.2, 2e-3), (1.0, 2e-3), (1.0, 0.0), (2.0, 0.0), (3.0, 0.03), (4.0, 0.0)],
    "axis": [(0.0, 0.0), (0.2, 0.0), (0.2, 0.01), (1.0, 0.01), (1.0, 0.0), (2.0, 0.0), (3.0, 0.1), (4.0, 0.0)],
}


def range_of(machine: Machine) -> Range:
    """The row of this machine's kind; of a described machine one that follows from its own reference.

    Raises UserError where there is none.
    """
    if machine.kind == DESCRIBED:
        return described_range(machine.config)
    if machine.kind not in RANGES:
        raise UserError(f"no soak for machine '{machine.kind}'; it is for {', '.join(RANGES)}")
    return RANGES[machine.kind]


def with_reference(config: Any) -> Any:
    """The config with a reference to play, where it has none."""
    given = config.reference
    if given.steps or len(given.knots) > 1:
        return config
    return config.model_copy(update={"reference": given.model_copy(update={"knots": knots_of(config)})})


def knots_of(config: Any) -> list[tuple[float, float]]:
    """Reference of a config that has none."""
    if config.kind == DESCRIBED:
        raise UserError(f"{config.name}: a soak moves as the reference does; give the config one")
    return KNOTS[config.kind]


def gains_of(config: Any) -> dict[str, tuple[float, float]]:
    """Settings that this config's law has and uses, each with its lowest and highest value in SI."""
    out = {}
    for path, (low, high) in (DESCRIBED_GAINS if config.kind == DESCRIBED else RANGES[config.kind].gains).items():
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
    if config.kind == "ldu":
        high, low = min(high, config.amplifier.limit), max(low, -config.amplifier.limit)
    return max(low, -full) - half, min(high, full) + half


def full_scale(config: Any) -> float:
    """Highest voltage of the converter."""
    wire = {"axis": lambda: config.output, "ldu": lambda: config.board.output}.get(
        config.kind, lambda: config.board.output1
    )()
    return abs(float(wire.external_volts)) if wire.external_volts else at_mio_16de.INTERNAL_VOLTS


def rounding(config: Any) -> float:
    """V that a row's output may differ from what the law wanted: half a code, one lost at the end of the scale, and
    what makes up for the knee of a measured amplifier."""
    if config.kind == DESCRIBED:
        return rounding_of(config)
    code = full_scale(config) / CODES
    amplifier = getattr(config, "amplifier", None)
    return 2 * code + (ldu_amplifier.KNEE_VOLTS if amplifier is not None and amplifier.compensate else 0.0)


def unknown(config: Any) -> set[str]:
    """Truth columns that stay empty: those that an own plant has no state of, and all of an FMU."""
    from rtctl.machines import own_plant
    from rtctl.own.plant import TRUTH

    if config.kind == DESCRIBED:
        return set()
    columns = [column.name for column in own_plant.COLUMNS[config.kind]]
    parts = own_plant.parts_of(config)
    if parts is not None:
        fields = zip(columns, TRUTH[config.kind], strict=True)
        return {column for column, field in fields if field not in (parts.state.names or ())}
    return set(columns) if config.plant.fmu is not None else set()


def counts_per_unit(config: Any) -> float:
    """Counts for one unit of the truth column; nan where a term of physics stands between the two, and where only an
    own plant knows what the linear drive's encoder turns on."""
    from rtctl.machines import own_plant
    from rtctl.plants import ldu
    from rtctl.plants.physics import TERMS

    if own_plant.is_own(config):
        if config.kind == "ldu":
            return float("nan")
    elif any(TERMS[t.term].act_at("reading", config.kind) is not None for t in config.plant.physics):
        return float("nan")
    if config.kind == DESCRIBED:
        return described_counts(config)
    if config.kind == "axis":
        return float(1.0 / config.encoder.pitch)
    sensor = config.sensors.capstan if config.kind == "ivu" else config.sensors.encoder
    per_rad = float(sensor.lines * sensor.multiply / (2 * np.pi))
    return per_rad / float(ldu.parameters(config.plant).R_c) if config.kind == "ldu" else per_rad
