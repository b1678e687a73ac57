"""Sound machine: random topology and motion, drives and law sized to both, and its case with nominal values."""

import math
from typing import Any

import numpy as np

from rtctl.proof import motion
from rtctl.proof.machines import topologies_linear, topologies_rotary  # noqa: F401  (they fill the table)
from rtctl.proof.machines.arrays import GRAVITY, VOLTAGE
from rtctl.proof.machines.describe import believe, gravities, record
from rtctl.proof.machines.draft import BUILD, Draft, between, pick
from rtctl.proof.machines.kinematics import ratios, reflected
from rtctl.proof.machines.law import law_record
from rtctl.proof.machines.setup import Hidden, Setup

Json = dict[str, Any]
SETTLE_S = 1.5  # s of closed loop before the first row
OPEN = " Open loop: the command was played from a file."
CLOSED = (
    " ref is the reference of {0}; the controller is not described, take the recorded command as the input. "
    "w was added to the controller's output."
)


def sound(topology: str, rng: np.random.Generator, how: str, need: frozenset[str], edge: bool) -> Setup:
    """Setup of a sound machine of `topology`; `need` are requirements of effects, `edge` sets nominal values at the
    edges of their tolerances."""
    d = BUILD[topology](rng, need)
    Ts = 1.0 / pick(rng, *d.rates)
    n = int(pick(rng, 8.0, 10.0, 12.0, 15.0, 20.0) / Ts)
    delay = pick(rng, 1.0, 1.0, 1.0, 0.5, 1.5, 2.0)
    opened = rng.random() < d.open_share
    band = between(rng, 30.0, min(100.0, 0.2 / Ts)) if how == "rich" else between(rng, 15.0, 30.0)
    base = d.sensors[d.control]["body"]
    ref = _reference(d, how, Ts)(rng, n)
    need_force, top_speed = _needed(d, base, ref, Ts)
    machine = {"bodies": d.bodies, "joints": d.joints, "drives": {}, "sensors": d.sensors}
    limit, pre = _drives(rng, d, machine, base, need_force, top_speed)
    _more_sensors(rng, machine)
    machine = _rounded(machine)
    m = record(machine, Ts, delay)
    law = _law(rng, d, machine, m, base, limit, pre, delay, opened)
    play = _play(rng, d, machine, m, base, law, how, band, opened, need_force, Ts, ref)
    first, w = play(rng, n)
    owner, said, truth = believe(machine, rng, edge)
    words = d.words + (OPEN if opened else CLOSED.format(d.control))
    case = {
        "format": 2, "sample_rate": round(1.0 / Ts, 6), "machine": owner, "delay_samples": delay, "tolerance": said,
        "controller": {"kind": "none" if opened else "unknown"}, "controller_known": opened, "notes": words,
    }  # fmt: skip
    columns = [(s["column"], float(s.get("resolution", 1.0))) for s in machine["sensors"].values()]
    commands = [drive["column"] for drive in machine["drives"].values()]
    s = Setup(topology, machine, m, law, case, truth, d.control, base, columns, commands,
              lambda again: play(again, n), first, w, int(SETTLE_S / Ts), how, band)  # fmt: skip
    s.hidden = _noise(rng, s, need_force)
    return s


def _reference(d: Draft, how: str, Ts: float) -> Any:
    def draw(rng: np.random.Generator, n: int) -> np.ndarray:
        if how == "rich":
            ref = motion.rich(rng, n, Ts, d.step, 0.04 * d.fast, d.fast, d.reach)
        else:
            ref = motion.production(rng, n, Ts, 1.4 * d.step, 0.8 * d.fast, d.reach)
        return np.abs(ref) if d.one_way else ref

    return draw


def _needed(d: Draft, base: str, ref: np.ndarray, Ts: float) -> tuple[float, float]:
    """Largest force (N or Nm at the base) and largest speed of the reference."""
    v = ref if d.speed_loop else np.gradient(ref, Ts)
    a = float(np.quantile(np.abs(np.gradient(v, Ts)), 0.998))
    top, F = float(np.abs(v).max()), reflected(d.machine, base) * a
    for name, g in ratios(d.machine, base).items():
        body = d.bodies[name]
        F += abs(g) * (body.get("dry", 0.0) + body.get("viscous", 0.0) * abs(g) * top)
        for entry in gravities(body):
            if "incline" in entry:
                F += abs(g) * body["mass"] * GRAVITY * abs(math.sin(entry["incline"]))
            else:
                F += abs(g) * entry["mass"] * GRAVITY * entry["arm"]
    return F, top


def _drives(
    rng: np.random.Generator, d: Draft, machine: Json, base: str, need: float, top: float
) -> tuple[float, list[float]]:
    """Fill machine["drives"]; returns the limit of the command and the preload of each drive, in command units."""
    kind = d.drivers[0].kinds[rng.integers(len(d.drivers[0].kinds))]
    volts = pick(rng, 12.0, 24.0, 48.0)
    limit = pick(rng, 1.0, 10.0, 10.0) if kind != "voltage" else pick(rng, 1.0, volts, volts)
    dac = {"dac_bits": int(pick(rng, 12, 16)), "dac_range": 10.0} if limit <= 10.0 and rng.random() < 0.6 else {}
    bandwidth = rng.random() < 0.75
    head, pre = rng.uniform(2.0, 3.5), []
    Kt0, tau = pick(rng, 0.03, 0.06, 0.1), between(rng, 3e-4, 1.5e-3) if rng.random() < 0.6 else 0.0
    for driver in d.drivers:
        g = abs(ratios(d.machine, base)[driver.body])
        F = driver.share * need / g * head * rng.uniform(0.97, 1.03)
        out: Json = {"body": driver.body, "column": "u" + driver.name[-1] if len(d.drivers) > 1 else "u", "kind": kind}
        if kind == "force":
            out |= {"gain": F / limit, "limit": limit}
        elif kind == "current":
            Kt = Kt0 if "inertia" in d.bodies[driver.body] else 300.0 * Kt0
            out |= {"gain": F / limit / Kt, "limit": limit, "torque_constant": Kt * rng.uniform(0.95, 1.05)}
        else:
            Kt = rng.uniform(0.35, 0.55) * volts / max(1.2 * top * g, 1e-9)
            R = Kt * volts / (1.8 * F)
            out |= {"gain": volts / limit, "limit": limit, "resistance": R, "torque_constant": Kt}
            if tau:
                out["inductance"] = tau * R
        if kind != "voltage" and bandwidth:
            out |= {"bandwidth_hz": between(rng, 400.0, 2000.0), "damping": rng.uniform(0.6, 0.9)}
        machine["drives"][driver.name] = out | dac
        pre.append(driver.preload / driver.share * limit / head)
    return limit, pre


def _more_sensors(rng: np.random.Generator, machine: Json) -> None:
    """Add optional sensors at random: a drive's current, a joint's force, an acceleration."""
    name, drive = next(iter(machine["drives"].items()))
    roll = rng.random()
    springs = [j for j, joint in machine["joints"].items() if "stiffness" in joint]
    if roll < 0.2 and drive["kind"] == "voltage":
        top = drive["gain"] * drive["limit"] / drive["resistance"]
        machine["sensors"]["shunt"] = {"drive": name, "measures": "current", "column": "current",
                                       "resolution": float(f"{top / 4096:.1g}"), "per_unit": 1.0}  # fmt: skip
    elif 0.2 < roll < 0.27 and springs:
        joint = machine["joints"][springs[-1]]
        top = _drive_force(drive) / abs(joint["ratio"])
        machine["sensors"]["load_cell"] = {"joint": springs[-1], "measures": "force", "column": "joint_force",
                                           "resolution": float(f"{top / 8192:.1g}"), "per_unit": 1.0}  # fmt: skip
    elif 0.27 < roll < 0.33:
        body = list(machine["bodies"])[-1]
        if "mass" in machine["bodies"][body]:
            machine["sensors"]["accelerometer"] = {"body": body, "measures": "acceleration", "column": "acceleration",
                                                   "resolution": 0.01, "per_unit": 1.0}  # fmt: skip


def _drive_force(drive: Json) -> float:
    """Force of a drive at the limit of the command, at standstill."""
    Kt, R = drive.get("torque_constant", 1.0), drive.get("resistance", 1.0)
    return float(drive["gain"] * drive["limit"] * Kt / R)


def _rounded(machine: Json) -> Json:
    """Description with numbers of six digits; counters and whole numbers are unchanged."""

    def walk(x: Any) -> Any:
        if isinstance(x, dict):
            return {k: v if k in ("counts_per_unit", "per_unit") else walk(v) for k, v in x.items()}
        if isinstance(x, list):
            return [walk(v) for v in x]
        return float(f"{float(x):.6g}") if isinstance(x, float) else x

    return dict(walk(machine))


def _law(
    rng: np.random.Generator, d: Draft, machine: Json, m: np.ndarray, base: str, limit: float, pre: list[float],
    delay: float, opened: bool,
) -> np.ndarray:  # fmt: skip
    """Law record: PID on the position, or PI on the speed, designed for the machine as one rigid body."""
    to = ratios(machine, base)
    J, per_unit, damp = reflected(machine, base), 0.0, 0.0
    for k, driver in enumerate(d.drivers):
        g = to[driver.body]
        voltage = m["d_kind"][k] == VOLTAGE
        per_unit += driver.share * g * float(m["d_gain"][k]) * (float(m["d_Kt"][k] / m["d_R"][k]) if voltage else 1.0)
        damp += g * g * float(m["d_Kt"][k] ** 2 / m["d_R"][k]) if voltage else 0.0
    Ts = float(m["Ts"])
    lag = Ts * (delay + 1.0)
    w = 2.0 * math.pi * between(rng, *d.loop_hz)
    w = min(w, 0.12 / lag)
    first = next(iter(machine["drives"].values()))
    step = 2.0 * first["dac_range"] / 2 ** first["dac_bits"] if "dac_bits" in first else 0.0
    sensor = machine["sensors"][d.control]
    unit = 1.0 / sensor.get("counts_per_unit", sensor.get("per_unit", 1.0) / sensor.get("resolution", 1.0))
    if d.speed_loop:
        kp, kd, ki = max(J * w - damp, 0.3 * J * w), 0.0, 0.4 * J * w * w
    else:
        kp = max(J * w * w, 0.5 * damp * w)
        kd, ki = max(1.5 * J * w - damp, 0.1 * J * w), 0.15 * kp * w
    keep = d.speed_loop or "gravity" in str(machine["bodies"]) or rng.random() < 0.5
    return law_record(
        tuple(pre), tuple(1.0 for _ in d.drivers), kp=kp / per_unit, kd=kd / per_unit,
        ki=ki / per_unit if keep else 0.0, ki_settle=ki / per_unit, tau=max(0.15 / w, 1.5 * Ts), unit=unit,
        file=float(opened), limit=limit, step=step,
        sensor=list(machine["sensors"]).index(d.control), top=first.get("dac_range", limit) - step, Ts=Ts,
        n=len(d.drivers),
    )  # fmt: skip


def _play(
    rng: np.random.Generator, d: Draft, machine: Json, m: np.ndarray, base: str, law: np.ndarray, how: str, band: float,
    opened: bool, need: float, Ts: float, ref0: np.ndarray,
) -> Any:  # fmt: skip
    """Function (rng, n) of the reference and the excitation, in command units."""
    limit = float(law["limit"])
    share = rng.uniform(0.03, 0.08) if how == "rich" else (0.01 if rng.random() < 0.5 else 0.0)
    draw = _reference(d, how, Ts)
    dry = sum(abs(g) * machine["bodies"][b].get("dry", 0.0) for b, g in ratios(machine, base).items())

    def play(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
        if not opened:
            w = motion.multisine(rng, n, Ts, share * limit, band, 0.5) if share else np.zeros(n)
            return draw(rng, n), w
        slow = motion.multisine(rng, n, Ts, 1.0, 1.5 + 2.0 * rng.random(), 0.5)
        fast = motion.multisine(rng, n, Ts, 0.4, band, 0.5)
        peak = _drive_force(next(iter(machine["drives"].values())))
        rms = limit * min(max(2.5 * dry / max(peak, 1e-30), 0.2), 0.3)
        w = slow + fast
        if d.speed_loop or machine["drives"].keys() == {"bridge"}:
            steps = draw(rng, n)
            steps = steps / max(float(np.abs(steps).max()), 1e-30)
            w = 2.2 * steps + 0.35 * w
        return np.zeros(n), np.clip(rms * w, -0.95 * limit, 0.95 * limit)

    return play


def _noise(rng: np.random.Generator, s: Setup, need: float) -> Hidden:
    """Noise of a quiet machine: white forces on the bodies and counts on the readings."""
    h = Hidden()
    to = ratios(s.machine, s.base)
    level = between(rng, 3e-4, 3e-3)
    for name, g in to.items():
        h.push_sd[s.body(name)] = level * need / abs(g) / len(to)
    for k, (name, sensor) in enumerate(s.machine["sensors"].items()):
        counter = "counts_per_unit" in sensor
        h.count_sd[k] = rng.uniform(0.1, 0.6) if counter else rng.uniform(0.3, 1.5)
        if not counter and rng.random() < 0.5:
            s.case["machine"]["sensors"][name]["noise"] = float(f"{h.count_sd[k] * sensor.get('resolution', 1.0):.2g}")
    return h
