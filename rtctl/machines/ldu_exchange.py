"""Exchange format 1 of the Linear Drive Unit."""

from collections.abc import Mapping
from typing import Any

from rtctl.drivers.ldu_amplifier import AMPERE_PER_VOLT
from rtctl.machines.exchange import DAMPING, DIRECT, Changes, Exchange, Numbers, Scale, digits, lines, numbers
from rtctl.plants import ldu as plant

TERMS = ("F_c", "B_c", "B_m", "K_m2")
MOST_VOLT = 10.0  # V, largest input of the amplifier


def believed(given: Mapping[str, float], drive: Any) -> Numbers:
    """Nominal value of every symbol, SI, with the gear ratio N from R_t / R_s where it is not given."""
    absent = {name: 0.0 for name in TERMS if name not in given}
    own = {name: value for name, value in given.items() if name != "N"}
    return {**with_ratio(plant.LduParameters(**{**absent, **own})), **({"N": given["N"]} if "N" in given else {})}


def symbols(settings: Any) -> Numbers:
    """Every symbol of a config's plant."""
    return with_ratio(plant.parameters(settings))


def with_ratio(parameters: plant.LduParameters) -> Numbers:
    """Every parameter, and the gear ratio."""
    found = numbers(parameters)
    return {**found, "N": found["R_t"] / found["R_s"]}


def settings(model: Mapping[str, float]) -> Numbers:
    """Parameters of a config's plant; R_s follows from the gear ratio N, which the equations use."""
    found = dict(model)
    if "N" in found and abs(found["R_t"] / found["R_s"] / found["N"] - 1.0) > 1e-9:
        found["R_s"] = found["R_t"] / found["N"]
    return found


def carried(model: Mapping[str, float], own: Numbers, case: Any) -> Changes:
    """Changes of a config: sensors and amplifier; friction compensation off, since the case's law has its own."""
    left: list[str] = []
    drive = case.drive
    changes: dict[str, Any] = {
        **lines(case.sensors.encoder_counts_per_rev, "the encoder", "sensors.encoder", left),
        "sensors.R_c": own["R_c"],
        "plant.bandwidth": drive.bandwidth_hz or DIRECT,
        "plant.damping": digits(drive.damping or DAMPING),
        "law.friction.F_c": 0.0,
    }
    if case.sensors.scale_m_per_count is not None:
        changes["sensors.scale.pitch"] = case.sensors.scale_m_per_count
    gain = drive.amp_per_volt[0]
    if abs(gain / AMPERE_PER_VOLT - 1.0) > 1e-9:
        left.append(f"the gain of the amplifier, {gain:g} A/V: it is {AMPERE_PER_VOLT:g} A/V here")
    most = min(drive.limit_volt or drive.dac_range_volt, MOST_VOLT)
    amps = min(most, drive.current_limit / AMPERE_PER_VOLT) if drive.current_limit else most
    changes |= {"amplifier.limit": most, "plant.amplifier.limit": amps}
    return changes, left


EXCHANGE = Exchange(
    parameters=plant.LduParameters,
    terms=TERMS,
    believed=believed,
    symbols=symbols,
    carried=carried,
    derived=("N",),
    scales={
        "encoder_counts": Scale("encoder_counts_per_rev"),
        "scale_counts": Scale("scale_m_per_count", per_turn=False, optional=True),
    },
    gains=1,
    radius="R_c",
    settings=settings,
)
