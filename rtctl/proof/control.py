"""Controllers of the cases: gains drawn around those of the thesis, and a note with the complete law."""

import math
from typing import Any

import numpy as np

IVU_NOTE = (
    "Two-reel unit. R_c is exact, R1 and R2 are estimates within radius_tolerance. DAC range +-10 V. tau_Fc is the "
    "believed dry friction of the capstan bearing. Law: e = ref - 2 pi capstan_counts / capstan_counts_per_rev; "
    "d += a ((e - e_prev) / Ts - d) with a = 1 - exp(-2 pi derivative_filter_hz Ts); uc = P e + D d + friction_Nm "
    "sign(ref step) / (K_m amp) + w; Ti = tension_N Ri / (K_m amp). pull: u1 = T1 + max(uc, 0), u2 = T2 + max(-uc, 0). "
    "differential: u1 = T1 + uc / 2, u2 = T2 - uc / 2. motor1: u1 = T1 + uc, u2 = T2. motor2: u1 = T1, u2 = T2 - uc. "
    "Clipped to +-limit_volt and rounded to the DAC step. Positive rotation of reel 1 and of the capstan go together, "
    "reel 2 turns the other way (thesis 4.9-4.17); positive torque on both motors pulls the tape taut."
)
LDU_NOTE = (
    "Linear drive. Radii, counts per turn and scale pitch are as measured. DAC range +-10 V, the loop clips at "
    "limit_volt. Law: e = ref - R_c 2 pi encoder_counts / encoder_counts_per_rev; e passes through 'sections' in "
    "order, each y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2] given as [b0, b1, b2, a1, a2]; "
    "u = y + w, clipped to +-limit_volt and rounded to the DAC step. F_c is dry friction at the carriage in N."
)
AXIS_NOTE = "One mass on a guide; F_c is dry, F_v viscous friction. DAC range +-10 V, rounded to the DAC step. Law: "
CASCADE = (
    "u = kp*kv*(ref - x) - kv*v, v = backward difference of the two-tap mean of x, clipped at limit_volt; "
    "w is added in volt"
)
AXIS_PD = (
    "e = ref - x passes through 'sections' in order, each y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] "
    "- a2 y[k-2] given as [b0, b1, b2, a1, a2]; u = y + w, clipped at limit_volt"
)


def ivu(rng: np.random.Generator) -> tuple[dict[str, Any], str]:
    """Controller of the reel unit: PD with one of four allocations."""
    P = rng.uniform(3.2, 5.4)
    how = rng.choice(["differential", "pull", "motor1", "motor2"], p=[0.5, 0.25, 0.125, 0.125])
    controller = {
        "kind": "pd", "P": round(P, 3), "D": round(P * rng.uniform(0.13, 0.17), 4),
        "derivative_filter_hz": float(rng.choice([40.0, 60.0, 80.0])),
        "tension_N": float(rng.choice([0.06, 0.08, 0.1, 0.15])),
        "friction_Nm": float(rng.choice([0.0, 0.0, 0.0015, 0.0024])), "allocation": str(how),
    }  # fmt: skip
    return controller, IVU_NOTE


def ldu(rng: np.random.Generator, heavy: bool) -> tuple[dict[str, Any], str]:
    """Controller of the linear drive at 10 kHz: PD, PI with velocity, or lead-lag with low-pass and notch."""
    Ts = 1e-4
    scale = (2.0 if heavy else 1.0) * rng.uniform(0.8, 1.15)
    kind = str(rng.choice(["pd", "pi_velocity", "lead_lag"]))
    P, D = 2500.0 * scale, 155.0 * scale
    if kind == "pd":
        c = {"kind": kind, "sections": [pd_section(P, D, 200.0, Ts)], "P": P, "D": D, "derivative_filter_hz": 200.0}
    elif kind == "pi_velocity":
        P *= 0.8
        I = 6.0 * P  # noqa: E741
        c = {"kind": kind, "sections": [pid_section(P, I, D, 200.0, Ts)], "P": P, "I": I, "D": D,
             "derivative_filter_hz": 200.0}  # fmt: skip
    else:
        k, tau_I, tau_D = 90000.0 * scale, 3.0, 0.0048
        sections = [
            first_order(k, tau_I / 20.0, tau_I, Ts), first_order(1.0, 10.0 * tau_D, tau_D, Ts),
            second_order((0.0, 0.0, 1.0), 0.7, 250.0, Ts), second_order((1.0, 0.1, 1.0), 0.5, 119.0, Ts),
        ]  # fmt: skip
        c = {"kind": kind, "sections": sections, "k": k, "tau_I": tau_I, "tau_D": tau_D, "notch_hz": 119.0,
             "low_pass_hz": 250.0}  # fmt: skip
    return c, LDU_NOTE


def axis(rng: np.random.Generator, M: float, K: float, delay: float) -> tuple[dict[str, Any], str]:
    """Controller of the axis: cascade as in the EMPS benchmark, or PD; bandwidth from the mass."""
    speed = rng.uniform(70.0, 120.0) / (1.0 + 0.4 * delay)
    kv = speed * M / K
    kp = speed * rng.uniform(0.3, 0.6)
    if rng.random() < 0.6:
        return {
            "kind": "cascade_p_v",
            "kp": round(kp, 3),
            "kv": round(kv, 4),
            "law": CASCADE,
        }, AXIS_NOTE + CASCADE + "."
    P, D = kp * kv, kv
    sections = [pd_section(P, D, 150.0, 1e-3)]
    return {
        "kind": "pd",
        "sections": sections,
        "P": P,
        "D": D,
        "derivative_filter_hz": 150.0,
    }, AXIS_NOTE + AXIS_PD + "."


def pd_section(P: float, D: float, f: float, Ts: float) -> list[float]:
    a = 1.0 - math.exp(-2.0 * math.pi * f * Ts)
    return [P + D * a / Ts, -P * (1.0 - a) - D * a / Ts, 0.0, a - 1.0, 0.0]


def pid_section(P: float, I: float, D: float, f: float, Ts: float) -> list[float]:  # noqa: E741
    """Section [b0, b1, b2, a1, a2] of P + I Ts / (1 - z^-1) + D filtered difference."""
    a = 1.0 - math.exp(-2.0 * math.pi * f * Ts)
    r, g = 1.0 - a, D * a / Ts
    return [P + I * Ts + g, -P * (1.0 + r) - I * Ts * r - 2.0 * g, P * r + g, -1.0 - r, r]


def first_order(k: float, zero: float, pole: float, Ts: float) -> list[float]:
    """Section [b0, b1, b2, a1, a2] of k (1 + zero s) / (1 + pole s), bilinear."""
    n, d = 2.0 * zero / Ts, 2.0 * pole / Ts
    return [k * (1.0 + n) / (1.0 + d), k * (1.0 - n) / (1.0 + d), 0.0, (1.0 - d) / (1.0 + d), 0.0]


def second_order(num: tuple[float, float, float], zeta: float, f: float, Ts: float) -> list[float]:
    """Section of (n2 s^2 + 2 n1 w s + n0 w^2) / (s^2 + 2 zeta w s + w^2), bilinear with prewarping."""
    c = 1.0 / math.tan(math.pi * f * Ts)
    n2, n1, n0 = num
    d0 = c * c + 2.0 * zeta * c + 1.0
    b = [n2 * c * c + 2.0 * n1 * c + n0, 2.0 * (n0 - n2 * c * c), n2 * c * c - 2.0 * n1 * c + n0]
    return [*(x / d0 for x in b), 2.0 * (1.0 - c * c) / d0, (c * c - 2.0 * zeta * c + 1.0) / d0]
