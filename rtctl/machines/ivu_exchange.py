"""Exchange format 1 of the Image Verification Unit."""

from collections.abc import Mapping
from typing import Any

from rtctl.machines.exchange import Changes, Exchange, Numbers, Scale, digits, lines, numbers
from rtctl.plants import ivu as plant

TERMS = ("d_tape", "tau_F1", "tau_F2", "tau_Fc")
SENSING_OHM = 0.24  # ohm, R_S of the driver, whose gain is ratio / R_S
MOST_BRIDGE_AMPERE = 2.5


def believed(given: Mapping[str, float], drive: Any) -> Numbers:
    """Nominal value of every symbol, SI; J_1 and J_2 follow from the radii (4.1, 4.2)."""
    absent = {name: 0.0 for name in TERMS if name not in given}
    return numbers(plant.parameters(plant.IvuSettings(parameters=plant.IvuParameters(**{**absent, **given}))))


def symbols(settings: Any) -> Numbers:
    """Every symbol of a config's plant, SI; d_tape is 0 where the radii are constant."""
    found = numbers(plant.parameters(settings))
    return found if settings.follow_tape else {**found, "d_tape": 0.0}


def carried(model: Mapping[str, float], own: Numbers, case: Any) -> Changes:
    """Changes of a config: sensors, radii and drivers."""
    left: list[str] = []
    drive = case.drive
    gain = drive.amp_per_volt[0]
    changes: dict[str, Any] = {
        **lines(case.sensors.capstan_counts_per_rev, "the capstan's encoder", "sensors.capstan", left),
        "radius.R1": own["R1"],
        "radius.R2": own["R2"],
        "radius.d_tape": own["d_tape"],
        "R_c": digits(model["R_c"]),
        "law.tension.amp_per_volt": gain,
        "plant.driver.ratio": digits(gain * SENSING_OHM),
    }
    if case.sensors.reel_counts_per_rev is not None:
        for i in (1, 2):
            changes[f"sensors.reel{i}.pulses"] = round(case.sensors.reel_counts_per_rev)
    if drive.amp_per_volt[1] != gain:
        left.append(f"the gain of drive 2, {drive.amp_per_volt[1]:g} A/V: both have {gain:g} A/V")
    if drive.current_limit is not None:
        changes["plant.driver.I_max"] = min(drive.current_limit, MOST_BRIDGE_AMPERE)
    if drive.bandwidth_hz is not None:
        left.append(f"the bandwidth of the drives, {drive.bandwidth_hz:g} Hz: the L292 of plant.driver has its own")
    return changes, left


EXCHANGE = Exchange(
    parameters=plant.IvuParameters,
    terms=TERMS,
    believed=believed,
    symbols=symbols,
    carried=carried,
    silent=("J_1", "J_2"),
    exact=("R_c",),
    scales={
        "capstan_counts": Scale("capstan_counts_per_rev"),
        "reel1_counts": Scale("reel_counts_per_rev"),
        "reel2_counts": Scale("reel_counts_per_rev"),
    },
    gains=2,
)
