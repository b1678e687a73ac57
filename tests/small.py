"""Small inputs for tests of many commands: a log of an axis and a campaign of two runs."""

from pathlib import Path

import numpy as np

MATRIX = """
campaign: small
config: ivu
seconds: 0.7
set: {reference: {steps: [{at: 0.1, to: 1.0}]}}
matrix: {law.position.gain: [25, 26]}
"""


def log_of(folder: Path) -> Path:
    """A small log of an axis in the form of a logger."""
    t = np.arange(600) / 100
    u = np.sin(5 * t) + np.sin(1.3 * t)
    x = np.cumsum(np.cumsum(u)) * 1e-4
    rows = (f"{t:.2f},{u:.4f},{x:.5f}" for t, u, x in zip(t, u, x, strict=True))
    path = folder / "log.csv"
    path.write_text("t,u,x\n" + "\n".join(rows) + "\n")
    return path
