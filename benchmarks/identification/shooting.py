"""Multiple shooting of the nominal structure in CasADi: initial states of short windows are additional unknowns.

As in nlgreyfast (Bock & Plitt 1984), solved by IPOPT. The structure is that of the nominal model with free viscous and
dry friction, as an engineer would choose.
"""

import casadi as ca
import numpy as np

from identification.records import Problem

WINDOW = 40  # rows of a window
ROWS = 3000  # most fitted rows; longer recordings are decimated
SOFT = 0.02  # share of the largest speed: width of the reversal of dry friction


def fit(p: Problem) -> tuple[np.ndarray, dict[str, float]]:
    """Free run (n - first,) over the rows to predict, and the numbers that were found."""
    every = max(1, p.first // ROWS)
    x0 = p.states
    top = float(np.max(np.abs(x0[:, 1])))
    o = p.owner
    scale_f = float(np.std(p.force)) or 1.0
    theta = ca.SX.sym("theta", 5)  # ln inertia, viscous, dry, ln gain of weight, offset
    s, u = ca.SX.sym("s", 2), ca.SX.sym("u")
    viscous0 = o.viscous or 0.1 * scale_f / top

    def rate(z):
        friction = (viscous0 * theta[1]) * z[1] + scale_f * theta[2] * ca.tanh(z[1] / (SOFT * top))
        total = u - friction - o.weight * ca.exp(theta[3]) * ca.sin(z[0]) - scale_f * theta[4]
        return ca.vertcat(z[1], total / (o.inertia * ca.exp(theta[0])))

    h = p.dt
    k1 = rate(s)
    k2 = rate(s + h / 2 * k1)
    k3 = rate(s + h / 2 * k2)
    k4 = rate(s + h * k3)
    step = ca.Function("step", [s, u, theta], [s + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    windows = p.first // WINDOW
    used = range(0, windows, every)
    run = step.mapaccum("run", WINDOW)
    nodes, T = ca.MX.sym("nodes", 2, windows), ca.MX.sym("T", 5)
    readings = 1 if p.shows_speed else 0
    cost, joined = 0, []
    unit = float(np.std(p.seen))
    state_scale = np.array([max(float(np.std(x0[:, 0])), 1e-12), max(float(np.std(x0[:, 1])), 1e-12)])
    for w in used:
        a = w * WINDOW
        path = run(state_scale * nodes[:, w], p.force[a : a + WINDOW].reshape(1, -1), ca.repmat(T, 1, WINDOW))
        cost += ca.sumsqr((path[readings, :-1] - p.seen[a + 1 : a + WINDOW].reshape(1, -1)) / unit)
        cost += ((state_scale * nodes[:, w])[readings] - p.seen[a]) ** 2 / unit**2
        if w + 1 < windows and (w + 1) in used:
            joined.append(path[:, -1] / state_scale - nodes[:, w + 1])
    prior = 1e-3 * (T[0] ** 2 + T[3] ** 2)
    problem = {"x": ca.vertcat(T, ca.vec(nodes)), "f": cost + prior}
    problem["g"] = ca.vertcat(*joined) if joined else ca.MX()
    quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.max_iter": 100, "ipopt.sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    start = np.concatenate(
        [[0.0, 1.0, o.dry / scale_f, 0.0, 0.0], (x0[: windows * WINDOW : WINDOW] / state_scale).ravel()]
    )
    low = np.concatenate([[-2.0, 0.0, 0.0, -2.0, -1.0], np.full(2 * windows, -np.inf)])
    high = np.concatenate([[2.0, 50.0, 2.0, 2.0, 1.0], np.full(2 * windows, np.inf)])
    found = solver(x0=start, lbx=low, ubx=high, lbg=0.0, ubg=0.0)
    th = np.array(found["x"]).ravel()[:5]
    later = step.mapaccum("later", len(p.seen) - p.first)
    path = later(x0[p.first], p.force[p.first :].reshape(1, -1), ca.repmat(ca.DM(th), 1, len(p.seen) - p.first))
    free = np.concatenate([[x0[p.first, readings]], np.array(path)[readings, :-1]])
    numbers = {
        "inertia": o.inertia * float(np.exp(th[0])), "viscous": viscous0 * float(th[1]), "dry": scale_f * float(th[2]),
        "weight": o.weight * float(np.exp(th[3])), "offset": scale_f * float(th[4]),
    }  # fmt: skip
    return free, numbers
