"""Config for a machine from the case of a recording that rtctl did not make.

The config starts from the shipped config for this kind of machine. The head of the file lists parts of the case without
a counterpart in a config.
"""

from typing import Any

from rtctl.case.format1 import Case, believed, exchange_of
from rtctl.case.laws import CascadeLaw, NoLaw, SectionsLaw, TapeLaw
from rtctl.config.fields import Shape, fill, put, written
from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.diagnose.model.by_symbol import Model
from rtctl.diagnose.record.format1 import Record
from rtctl.laws import sections
from rtctl.machines.exchange import digits

FASTEST = 50e3  # Hz, highest rate of the loop of rtctl


def carried(model: Model, record: Record) -> tuple[dict[str, Any], list[str]]:
    """Config as plain data, without the part of the model, and a sentence on each part of the case left out."""
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
    exchange = exchange_of(kind)
    for more, words in (exchange.carried(model.base, believed(case), case), _law(model, case, record.dt)):
        changes.update(more)
        left += words
    for path, value in changes.items():
        put(data, Shape(config, model=config), path, value)
    return fill(Shape(config, model=config), data), left


def _law(model: Model, case: Case, dt: float) -> tuple[dict[str, Any], list[str]]:
    """Law of the case, or a stand-in, as values by path; sentences on the parts left out."""
    changes, law = _limit(case), case.controller
    if isinstance(law, TapeLaw):
        more, left = _with_tape(law)
        return changes | more, left
    if isinstance(law, SectionsLaw) and len(law.sections) <= sections.MOST:
        changes["law.position"] = {"kind": "sections", "sections": [_biquad(s) for s in law.sections]}
        return changes, ["the start of the law: rtctl begins where the machine stands, with its shaper and limits"]
    if isinstance(law, CascadeLaw):
        gains = {"gain": digits(law.kp * law.kv), "velocity_gain": law.kv}
        changes["law.position"] = {"kind": "pi_velocity", **gains}
        return changes, ["the law to the bit: the recorded law takes the speed from the mean of two readings"]
    stand_in = exchange_of(case.plant).stand_in
    if stand_in is None:
        return changes, [_unknown(case)]
    position, hertz = stand_in(model.base, dt)
    return changes | {"law.position": position}, [f"{_unknown(case)}; a cascade of {hertz:.3g} Hz replaces it"]


def _with_tape(law: TapeLaw) -> tuple[dict[str, Any], list[str]]:
    """Law of two motors that pull at a tape, as values by path; sentences on the parts left out."""
    position: dict[str, Any] = {"gain": max(law.P, 0.0), "tau_d": digits(law.D / law.P) if law.P > 0 else 0.0}
    if law.derivative_filter_hz is not None:
        position["derivative_filter"] = law.derivative_filter_hz
    friction = max(law.friction_Nm, 0.0)
    changes = {
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
            "friction compensation by the sign of the reference's step: rtctl goes from motor to motor with speed"
        )
    return changes, left


def _biquad(section: tuple[float, ...]) -> dict[str, Any]:
    return {"kind": "biquad", **dict(zip(("b0", "b1", "b2", "a1", "a2"), section, strict=True))}


def _limit(case: Case) -> dict[str, Any]:
    limit = case.drive.limit_volt
    return {} if limit is None else {"law.limit.high": min(limit, case.drive.dac_range_volt)}


def _unknown(case: Case) -> str:
    if isinstance(case.controller, NoLaw):
        return "a law: it was driven open loop"
    return f"the owner's law, '{case.controller.kind}'"
