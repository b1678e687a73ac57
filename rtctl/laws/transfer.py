"""Sampled linear systems of laws, for design: x' = A x + b v, u = c x + d v from tick to tick."""

import numpy as np

System = tuple[np.ndarray, np.ndarray, np.ndarray, float]  # A (n, n), b (n,), c (n,) and d


def response(system: System, z: np.ndarray) -> np.ndarray:
    """Response (n,) of a system at `z` (n,), e^(j w dt)."""
    A, b, c, d = system
    return np.asarray(d + np.einsum("i,nij,j->n", c, np.linalg.inv(z[:, None, None] * np.eye(len(A)) - A), b))
