"""Equations of the two-reel unit and the linear drive from the thesis, independent of plants/."""

from typing import Any

import numpy as np


def accelerations(p: Any, q: np.ndarray, v: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Accelerations (5,) by (4.9)-(4.17): motor 1, reel 1, capstan, reel 2, motor 2; `torque` (5,), Nm."""
    grow = p.d_tape / (2 * np.pi)
    R1, R2 = p.R1 + grow * q[1], p.R2 + grow * q[3]
    J1 = p.J_1 + 0.5 * np.pi * p.rho_h * (R1**4 - p.R1**4)
    J2 = p.J_2 + 0.5 * np.pi * p.rho_h * (R2**4 - p.R2**4)
    l1, l2 = p.R1 * q[1] + 0.5 * grow * q[1] ** 2, p.R2 * q[3] + 0.5 * grow * q[3] ** 2
    x, dx = p.R_c * q[2], p.R_c * v[2]
    F1 = p.c1 * (x - l1) + p.k1 * (dx - R1 * v[1])
    F2 = p.c2 * (-x - l2) + p.k2 * (-dx - R2 * v[3])
    tau1 = p.c_m1 * (q[0] - q[1]) + p.k_m1 * (v[0] - v[1])
    tau2 = p.c_m2 * (q[4] - q[3]) + p.k_m2 * (v[4] - v[3])
    forces = np.array([-tau1, F1 * R1 + tau1, p.R_c * (F2 - F1), F2 * R2 + tau2, -tau2])
    return (forces + torque) / np.array([p.J_m1, J1, p.J_c, J2, p.J_m2])


def runge_kutta(p: Any, torque: np.ndarray, seconds: float, steps: int) -> np.ndarray:
    """State (10,) of the two-reel unit after `seconds` from rest under constant torques."""
    h, x = seconds / steps, np.zeros(10)

    def rate(x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[5:], accelerations(p, x[:5], x[5:], torque)])

    for _ in range(steps):
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        k4 = rate(x + h * k3)
        x = x + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x


def ivu(p: Any, drives: list) -> tuple[np.ndarray, np.ndarray]:
    """A (14, 14) and B (14, 2) of the two-reel unit at its initial radii."""
    A, B = np.zeros((14, 14)), np.zeros((14, 2))
    A[:5, 5:10] = np.eye(5)
    zero = np.zeros(5)
    for i in range(5):
        A[5:10, i] = accelerations(_thin(p), np.eye(5)[i], zero, zero)
        A[5:10, 5 + i] = accelerations(_thin(p), zero, np.eye(5)[i], zero)
    for d, (motor, K, J) in enumerate(((0, p.K_m1, p.J_m1), (4, p.K_m2, p.J_m2))):
        gain, w, zeta, lead = drives[d]
        a = 10 + 2 * d  # I = x + lead x'
        A[a, a + 1], A[a + 1, a], A[a + 1, a + 1] = w, -w, -2 * zeta * w
        B[a + 1, d] = w * gain
        A[5 + motor, a], A[5 + motor, a + 1] = K / J, K / J * lead * w
    return A, B


def _thin(p: Any) -> Any:
    return p._replace(d_tape=0.0)


def ldu(p: Any, w: float, zeta: float) -> tuple[np.ndarray, np.ndarray]:
    """A (10, 10) and B (10, 1) of the linear drive (F.1)-(F.9): motor, wheel, capstan, encoder, amplifier."""
    N, J = p.N, p.J_c + p.M * p.R_c**2

    def torques(q: np.ndarray, k_s: float, k_c: float) -> np.ndarray:
        shaft, one, two = k_s * (q[0] - N * q[1]), k_c * (q[1] - q[2]), k_c * (q[2] - q[3])
        return np.array([-shaft, N * shaft - one, one - two, two])

    A, B = np.zeros((10, 10)), np.zeros((10, 1))
    A[:4, 4:8] = np.eye(4)
    inertia = np.array([p.J_m, p.J_t, J, p.J_e])
    for i in range(4):
        A[4:8, i] = torques(np.eye(4)[i], p.k_s, p.k_c) / inertia
        A[4:8, 4 + i] = torques(np.eye(4)[i], p.b_s, p.b_c) / inertia
    A[4, 4] -= p.K_m2 / p.J_m
    A[6, 6] -= (p.B_c + p.R_c**2 * p.B_m) / J
    A[4, 8] = p.K_m1 / p.J_m
    A[8, 9], A[9, 8], A[9, 9], B[9, 0] = w, -w, -2 * zeta * w, w
    return A, B
