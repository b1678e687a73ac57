"""What a model lacks, as a force or a reading, against the axis where it lives."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import t

from rtctl.diagnose import words
from rtctl.diagnose.diagnosis import Diagnosis
from rtctl.diagnose.kernel import TRACK
from rtctl.diagnose.model import Model
from rtctl.diagnose.quantities import DIMENSIONS, of_case
from rtctl.diagnose.scales import spaced, speed
from rtctl.diagnose.simulate import Simulator, gear, lever, per_unit, way
from rtctl.plants.physics import TERMS

FASTER = 2.0  # than the simulator's own observer
LEAST = 12  # samples in a bin
BLOCK = 0.1  # s, over which errors are taken as one
GAP = 0.25  # of the axis: no line is drawn across


def observe(sim: Simulator, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n, sensors) of the model on track and the push (n,) that keeps it there; fast, but not at any price:
    with a faster observer the push would be the noise of the counters, and a springy machine runs away."""
    for faster in (FASTER, 1.0):
        out, _, push = sim.everything(model, TRACK, follow=faster * sim.follow)
        if np.isfinite(out).all():
            break
    return out, np.nan_to_num(push)


class Missing:
    """What the model lacks at a node, seen against the axis where it lives."""

    def __init__(self, d: Diagnosis, sim: Simulator):
        record = d.record
        self.d, self.sim, self.kind = d, sim, record.plant
        self.rows = slice(min(d.fit_rows[0] + round(0.2 / record.dt), len(record.t) // 4), None)
        self.out, self.push = observe(sim, d.before)
        after, push = observe(sim, d.after) if d.after.terms else (self.out, self.push)
        self.law, self.shift = self.push - push, after - self.out
        self.x, self.units = way(record), of_case(record.case)

    def slides(self, node: str) -> bool:
        """Whether the node moves in m and not in rad."""
        return words.slides(self.kind, "", node, self.units)

    def unit(self, quantity: str, node: str) -> str:
        """Of a quantity at the node."""
        return DIMENSIONS[quantity][self.slides(node)]

    def ratio(self, node: str) -> float:
        """Way of the node for one of the main sensor."""
        b, node = self.d.before.base, node.replace("drive", "motor")
        turn = gear(self.kind, b, node)
        if self.kind == "ivu" and node.startswith("tape"):
            return float(b["R_c"] * np.sign(turn))
        return b["R_c"] if self.kind == "ldu" and node in ("carriage", "scale") else turn

    def force(self, node: str) -> tuple[np.ndarray, np.ndarray, str]:
        """What is missing and what the terms give, both (n,), as a force on the node in its unit."""
        node = node.replace("drive", "motor") if self.kind != "axis" else "carriage"
        node = "motor" if (node, self.kind) == ("loop", "ldu") else node
        factor = lever(self.d.record, self.d.before.base) / self.ratio(node)
        return factor * self.push, factor * self.law, self.unit("force", node)

    def reading(self) -> tuple[np.ndarray, np.ndarray, str]:
        """Missing reading of the second sensor where there is one that knows direction."""
        step = 1.0 / per_unit(self.d.record.case)[1]
        e = (self.sim.record.y["scale_counts"] + self.sim.half - self.out[:, 1]) * step
        law = self.shift[:, 1] * step
        return e - np.mean(e[self.rows]), law - np.mean(law[self.rows]), "m"

    def of(self, name: str, node: str) -> tuple[np.ndarray, np.ndarray, str, str]:
        """Missing, law, unit and what it is, for a term at a node."""
        acts = TERMS[name].act if name in TERMS else {}
        if any(site.startswith("reading") for site in acts) and "scale_counts" in self.sim.channels:
            return *self.reading(), "missing way of the scale"
        y, law, unit = self.force(node)
        return y, law, unit, f"missing {'torque' if unit == DIMENSIONS['force'][0] else 'force'}"

    def abscissa(self, axis: str, node: str) -> tuple[np.ndarray, str, str]:
        """Values (n,) of an axis, its name and unit."""
        record, ratio, slides = self.d.record, self.ratio(node), self.slides(node)
        if axis == "velocity":
            return ratio * speed(self.x, self.kind, record.dt), "speed", self.unit("speed", node)
        if axis == "angle" and not slides:
            return np.mod(ratio * self.x, 2 * np.pi), "angle", "rad"
        if axis in ("position", "angle"):
            return ratio * self.x, "position", self.unit("position", node)
        if axis in ("command", "tension"):
            channel = 1 if node.endswith("2") else 0
            u = record.u if axis == "command" else np.abs(record.u)
            what = "command" if axis == "command" else "size of the command"
            return u[:, min(channel, u.shape[1] - 1)], what, self.units.command
        return record.t - record.t[0], "time", "s"


def binned(
    x: np.ndarray, y: np.ndarray, law: np.ndarray, count: int, block: int, middle: Callable[..., Any] = np.median
) -> np.ndarray:
    """Along x: middles, medians of y (or another `middle`), half widths of their 95 % bands, and medians of the law,
    (4, bins).

    Neighbouring samples are not independent: the band comes from the scatter of the means of `block` rows, visit by
    visit. Each bin has the same sum of its shares of the way along x and of the samples; a gap in x leaves a column of
    nan.
    """
    lo, hi = np.quantile(x, (0.002, 0.998))
    edges = spaced(np.sort(x[(x >= lo) & (x <= hi)]), lo, hi, count + 1)
    index = np.searchsorted(edges, x) - 1
    out: list[tuple[float, ...]] = []
    for k in range(len(edges) - 1):
        here = np.flatnonzero(index == k)
        visits, number = np.unique(here // block, return_inverse=True)
        if len(here) >= LEAST and len(visits) > 2:
            means = np.bincount(number, y[here]) / np.bincount(number)
            half = float(t.ppf(0.975, len(visits) - 1) * np.std(means, ddof=1) / np.sqrt(len(visits)))
            at = float(np.median(x[here]))
            if out and at - out[-1][0] > GAP * (hi - lo):
                out.append((np.nan,) * 4)
            out.append((at, float(middle(y[here])), half, float(middle(law[here]))))
    return np.array(out, float).reshape(-1, 4).T
