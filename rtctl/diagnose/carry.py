"""A config for a machine whose recording somebody else made: what of its case our own config has a place for.

It starts from the config that comes with rtctl for this kind of machine. What it has no place for is said in words,
which go into the head of the file.
"""

from typing import Any

import numpy as np

from rtctl.config.fields import Shape, fill, put, written
from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.diagnose.case import DAMPING, CascadeLaw, Case, NoLaw, PdLaw, SectionsLaw, believed
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record

FASTEST = 50e3  # Hz, of our loop
MOST_SECTIONS = 4
SENSING_OHM = 0.24  # of the ivu's driver, whose gain is ratio / R_S
LDU_GAIN = 0.1  # A/V, of the ldu's amplifier
MOST_BRIDGE_AMPERE = 2.5
DIRECT = 20e3  # Hz, bandwidth of a drive of which the owner says nothing
CAUTIOUS = 20.0  # ticks a radian of the loop that stands in for a law that nobody knows


def digits(value: float) -> float:
    """Six significant digits."""
    return float(f"{value:.6g}")


def carried(model: Model, record: Record) -> tuple[dict[str, Any], list[str]]:
    """Plain data of a config without the model's own part, and a sentence on each thing that it has no place for."""
    from rtctl import machines

    kind, case = record.plant, record.case
    config = machines.CONFIGS[kind]
    data = written(load_settings(find(kind), config))
    left: list[str] = []
    changes: dict[str, Any] = {"loop.rate": digits(min(1.0 / record.dt, FASTEST))}
    if 1.0 / record.dt > FASTEST:
        left.append(f"the rate, {1 / record.dt:g} Hz: {FASTEST:g} Hz is the most")
    changes["loop.write"] = "next_tick" if case.delay_samples >= 0.5 else "same_tick"
    if case.delay_samples not in (0.0, 1.0):
        left.append(f"the delay, {case.delay_samples:g} samples: loop.write gives {round(case.delay_samples >= 0.5)}")
    if case.sample_rate is None:
        left.append("the uneven clock of the recording")
    for part in (PARTS[kind], LAWS[kind]):
        more, words = part(model, case, record.dt)
        changes.update(more)
        left += words
    for path, value in changes.items():
        put(data, Shape(config, model=config), path, value)
    return fill(Shape(config, model=config), data), left


def _lines(counts: float | None, what: str, path: str, left: list[str]) -> dict[str, Any]:
    """Lines of an encoder that counts each of them four times, or once."""
    if counts is None:
        return {}
    whole = round(counts)
    if whole != counts:
        left.append(f"{what}, {counts:g} counts a turn: {whole} are taken")
    return {path: {"lines": whole // 4} if whole % 4 == 0 else {"lines": whole, "multiply": 1}}


def _ivu(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    left: list[str] = []
    own, drive = believed(case), case.drive
    gain = drive.amp_per_volt[0]
    changes: dict[str, Any] = {
        **_lines(case.sensors.capstan_counts_per_rev, "the capstan's encoder", "sensors.capstan", left),
        "radius.R1": own["R1"],
        "radius.R2": own["R2"],
        "radius.d_tape": own["d_tape"],
        "R_c": digits(model.base["R_c"]),
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


def _ldu(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    left: list[str] = []
    drive = case.drive
    changes: dict[str, Any] = {
        **_lines(case.sensors.encoder_counts_per_rev, "the encoder", "sensors.encoder", left),
        "sensors.R_c": believed(case)["R_c"],
        "plant.bandwidth": drive.bandwidth_hz or DIRECT,
        "plant.damping": digits(drive.damping or DAMPING),
    }
    if case.sensors.scale_m_per_count is not None:
        changes["sensors.scale.pitch"] = case.sensors.scale_m_per_count
    if abs(drive.amp_per_volt[0] / LDU_GAIN - 1.0) > 1e-9:
        left.append(f"the gain of the amplifier, {drive.amp_per_volt[0]:g} A/V: it is {LDU_GAIN:g} A/V here")
    most = min(drive.limit_volt or drive.dac_range_volt, 10.0)
    amps = min(most, drive.current_limit / LDU_GAIN) if drive.current_limit else most
    changes |= {"amplifier.limit": most, "plant.amplifier.limit": amps}
    return changes, left


def _axis(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    sensors, left = case.sensors, []
    pitch = 2 * np.pi / sensors.x_counts_per_rev if sensors.x_counts_per_rev else sensors.x_resolution_m
    changes: dict[str, Any] = {}
    if pitch:
        changes["encoder.pitch"] = digits(pitch)
    if sensors.unit not in (None, "m"):
        left.append(f"the unit of the position, {sensors.unit}: read {sensors.unit} for m throughout")
    if case.drive.unit != "V":
        left.append(f"the unit of the command, {case.drive.unit}: read {case.drive.unit} for V throughout")
    return changes, left


def _ivu_law(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    changes, law = _limit(case), case.controller
    if not isinstance(law, PdLaw):
        return changes, [_unknown(case)]
    position: dict[str, Any] = {"gain": max(law.P, 0.0), "tau_d": digits(law.D / law.P) if law.P > 0 else 0.0}
    if law.derivative_filter_hz is not None:
        position["derivative_filter"] = law.derivative_filter_hz
    friction = max(law.friction_Nm, 0.0)
    changes |= {
        "law.position": position,
        "law.tension.F_t": law.tension_N,
        "law.allocation.kind": law.allocation,
        "law.inertia.share": 0.0,
        "law.gain_schedule.mode": "off",
        "law.friction.motor1.tau_C": friction,
        "law.friction.motor2.tau_C": friction,
    }
    left = ["the law to the last bit: tension is ramped up, and the shaper of the shipped config rounds off steps"]
    if friction:
        left.append(
            "friction compensation by the sign of the reference's step: ours goes from motor to motor with speed"
        )
    return changes, left


def _linear_law(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    """Of a machine that works in metres."""
    changes, law = _limit(case), case.controller
    if case.plant == "ldu":
        changes["law.friction.F_c"] = 0.0
    if isinstance(law, SectionsLaw) and len(law.sections) <= MOST_SECTIONS:
        changes["law.position"] = {"kind": "sections", "sections": [_biquad(s) for s in law.sections]}
        return changes, ["the start of the law: ours begins where the machine stands, with its shaper and limits"]
    if isinstance(law, CascadeLaw):
        gains = {"gain": digits(law.kp * law.kv), "velocity_gain": law.kv}
        changes["law.position"] = {"kind": "pi_velocity", **gains}
        return changes, ["the law to the last bit: its speed is that of the mean of two readings"]
    if case.plant == "axis":
        w = 1.0 / (CAUTIOUS * dt)
        k_v = model.base["M"] * w / model.base["K"]
        gains = {"gain": digits(k_v * w / 4), "velocity_gain": digits(k_v)}
        changes["law.position"] = {"kind": "pi_velocity", **gains}
        return changes, [_unknown(case) + f"; a cascade of {w / (8 * np.pi):.3g} Hz stands in its place"]
    return changes, [_unknown(case)]


def _biquad(section: tuple[float, ...]) -> dict[str, Any]:
    return {"kind": "biquad", **dict(zip(("b0", "b1", "b2", "a1", "a2"), section, strict=True))}


def _limit(case: Case) -> dict[str, Any]:
    limit = case.drive.limit_volt
    return {} if limit is None else {"law.limit.high": min(limit, case.drive.dac_range_volt)}


def _unknown(case: Case) -> str:
    if isinstance(case.controller, NoLaw):
        return "a law: it was driven open loop"
    return f"the owner's law, '{case.controller.kind}'"


PARTS = {"ivu": _ivu, "ldu": _ldu, "axis": _axis}
LAWS = {"ivu": _ivu_law, "ldu": _linear_law, "axis": _linear_law}
