"""Small neural state-space model: the acceleration is a network of position, speed and force, trained on simulations.

Two layers of 16 units; windows of 50 rows from smoothed states; Adam, in JAX. As in Forgione & Piga, Continuous-time
system identification with neural networks, Eur. J. Control 59 (2021).
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from identification.records import Problem

UNITS, WINDOW, BATCH, STEPS, RATE = 16, 50, 32, 3000, 3e-3


def fit(p: Problem) -> tuple[np.ndarray, dict[str, float]]:
    """Free run (n - first,) over the rows to predict, and no parameters: those of a network have no meaning."""
    states, column = p.states, 1 if p.shows_speed else 0
    scale = jnp.array([max(np.std(states[:, 0]), 1e-12), max(np.std(states[:, 1]), 1e-12), np.std(p.force) or 1.0])
    a0 = float(np.std(np.gradient(states[: p.first, 1], p.dt)))
    rng = np.random.default_rng(0)

    def layer(n, m):
        return jnp.array(rng.standard_normal((n, m)) / np.sqrt(n)), jnp.zeros(m)

    w = [layer(3, UNITS), layer(UNITS, UNITS), layer(UNITS, 1)]

    def rate(w, s, u):
        z = jnp.concatenate([s, u[None]]) / scale
        for W, b in w[:-1]:
            z = jnp.tanh(z @ W + b)
        return a0 * (z @ w[-1][0] + w[-1][1])[0]

    def run(w, s, force):
        def step(s, u):
            v = s[1] + p.dt * rate(w, s, u)
            return jnp.array([s[0] + p.dt * v, v]), s

        return jax.lax.scan(step, s, force)[1]

    def loss(w, s, force, seen):
        out = jax.vmap(run, (None, 0, 0))(w, s, force)[..., column]
        return jnp.mean((out - seen) ** 2) / p.spread**2

    grad = jax.jit(jax.value_and_grad(loss))
    m = v = jax.tree.map(jnp.zeros_like, w)
    for k in range(1, STEPS + 1):
        at = rng.integers(0, p.first - WINDOW, BATCH)
        rows = at[:, None] + np.arange(WINDOW)
        _, g = grad(w, jnp.array(states[at]), jnp.array(p.force[rows]), jnp.array(p.seen[rows]))
        m = jax.tree.map(lambda a, b: 0.9 * a + 0.1 * b, m, g)
        v = jax.tree.map(lambda a, b: 0.999 * a + 0.001 * b**2, v, g)
        w = jax.tree.map(partial(_moved, k), w, m, v)
    free = np.array(jax.jit(run)(w, jnp.array(states[p.first]), jnp.array(p.force[p.first :])))[:, column]
    return free, {}


def _moved(k: int, w: Any, m: Any, v: Any) -> Any:
    """Weights after step k of Adam with a cosine-decaying rate."""
    rate = RATE * 0.5 * (1.0 + np.cos(np.pi * k / STEPS))
    return w - rate * (m / (1.0 - 0.9**k)) / (jnp.sqrt(v / (1.0 - 0.999**k)) + 1e-8)
