"""How sure the numbers are: intervals from the Jacobian, with errors that go together for a while.

cov = A^-1 B A^-1 + D G C G' D,  G = A^-1 P, A = J'J + P, with P the weight that the owner's values have in the fit, C
what they may be off by (evenly within their tolerance) and B the sum over blocks of J'r r'J within a block: the errors'
share and the share of owner's values that are wrong. Nobody knows whether these are wrong each by itself or all by one
factor, as after a force that was measured with a bad gauge: D allows for the worst, that they add up.

Of a term's own numbers the record tells what suits the library's law best. The machine's law is another one, a little:
`with_form` allows for that, by as much as it took on generated machines whose laws are richer than the library's.

Source: White, Econometrica 48 (1980) for the sandwich; Kunsch, Annals of Statistics 17 (1989) for blocks.
"""

import numpy as np

from rtctl.diagnose.case import PARAMETERS
from rtctl.diagnose.diagnosis import Interval
from rtctl.diagnose.fit import Fit, trust
from rtctl.diagnose.model import ADDS_DRY, DRY, Model, dry_friction
from rtctl.diagnose.space import COSINE, INVERSE, PLACE, PRIOR, SHAPE, SINE, Hypothesis
from rtctl.diagnose.stretches import in_blocks
from rtctl.diagnose.words import unit_at
from rtctl.plants.physics import TERMS

Z90 = 1.645
FORM = 0.05, 0.02  # standard deviations of sizes and of shapes, as shares, that the form of a law leaves open
LITTLE = 0.01, 0.001  # the same of terms whose sizes are defined
EVEN = 1.0 / np.sqrt(3.0)  # standard deviation of what lies evenly within one either way


def covariance(fitted: Fit, block: int) -> np.ndarray:
    """Covariance of x (n, n)."""
    weight = trust(fitted.r)
    prior = fitted.space.prior() * weight
    scores = in_blocks(fitted.J * fitted.r[:, None], block if len(fitted.r) >= 2 * block else 1)
    A = fitted.J.T @ fitted.J + np.diag(prior)
    d = np.sqrt(np.maximum(np.diag(A), 1e-12))
    inverse = np.linalg.pinv(A / np.outer(d, d), rcond=1e-12) / np.outer(d, d)
    white = fitted.J.T @ fitted.J * float(np.mean(fitted.r**2))
    meat = scores.T @ scores
    meat = np.where(np.eye(len(d), dtype=bool), np.maximum(meat, white), meat)
    off = inverse * np.sqrt(prior * weight) * EVEN / PRIOR  # (n, n): of each unknown by each value that is off
    one_by_one = off @ off.T
    most = np.abs(off).sum(axis=1) / np.sqrt(np.maximum(np.diag(one_by_one), 1e-300))
    return inverse @ meat @ inverse + one_by_one * np.outer(most, most)


def with_form(fitted: Fit, cov: np.ndarray) -> np.ndarray:
    """The covariance (n, n) with what the form of the laws leaves open of their terms' numbers."""
    more = np.zeros(len(cov))
    for index, (h, x) in enumerate(zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)):
        columns = fitted.space.columns(index)
        form, shape = LITTLE if TERMS[h.term].defined else FORM
        for i, c in enumerate(h.coordinates):
            if c.kind in (COSINE, SINE):
                j = i if c.kind == COSINE else i - 1
                more[columns[i]] = form * np.hypot(x[j], x[j + 1])
            elif c.kind == SHAPE:
                more[columns[i]] = shape
            elif c.kind != PLACE:
                more[columns[i]] = form * abs(x[i])
    return cov + np.diag(more**2)


def parameter_intervals(fitted: Fit, cov: np.ndarray) -> dict[str, Interval]:
    """90 % intervals of the plant's parameters, within the owner's tolerance."""
    low, high = fitted.space.bounds()
    out = {}
    for i, name in enumerate(fitted.space.names):
        owner = fitted.space.owner.base[name]
        half = Z90 * float(np.sqrt(max(cov[i, i], 0.0)))
        ends = np.clip([fitted.x[i] - half, fitted.x[i] + half], low[i], high[i])
        a, b = sorted(owner * np.exp(ends))
        out[name] = Interval(float(owner * np.exp(fitted.x[i])), float(a), float(b), plant_unit(fitted.model, name))
    return out


def effect_intervals(fitted: Fit, index: int, cov: np.ndarray) -> dict[str, Interval]:
    """90 % intervals of the parameters of one hypothesis."""
    h, model = fitted.space.hypotheses[index], fitted.model
    columns = fitted.space.columns(index)
    own = cov[np.ix_(columns, columns)]
    x = fitted.space.parts(fitted.x)[index]
    values = h.values(x)
    out: dict[str, Interval] = {}
    for i, c in enumerate(h.coordinates):
        half = Z90 * float(np.sqrt(max(own[i, i], 0.0)))
        if c.kind == COSINE:
            out |= _turn(model, h, x, i, own[i : i + 2, i : i + 2], values)
        elif c.kind == SHAPE:
            v = values[c.name]
            out[c.name] = Interval(
                v, v * float(np.exp(-min(half, 5))), v * float(np.exp(min(half, 5))), parameter_unit(model, h, c.name)
            )
        elif c.kind == INVERSE:
            least, most = (c.scale / max(x[i] + s * half, 1e-9) for s in (1, -1))
            out[c.name] = Interval(values[c.name], least, most, parameter_unit(model, h, c.name))
        elif c.kind in ("size", PLACE):
            v, w = values[c.name], abs(c.scale) * half
            out[c.name] = Interval(v, v - w, v + w, parameter_unit(model, h, c.name))
    out |= {n: Interval(v, v, v, parameter_unit(model, h, n)) for n, v in h.fixed.items() if n in TERMS[h.term].counted}
    if h.term == ADDS_DRY:
        return with_total(out, fitted, h, cov, columns[0])
    return at_standstill(out, fitted, index, cov) if TERMS[h.term].falls_to else out


def at_standstill(own: dict[str, Interval], fitted: Fit, index: int, cov: np.ndarray) -> dict[str, Interval]:
    """F_s with the dry friction that another term adds at the node, which the law itself does not count."""
    h = fitted.space.hypotheses[index]
    for other, found in enumerate(fitted.space.hypotheses):
        if (found.term, found.node) == (ADDS_DRY, h.node):
            columns = [fitted.space.columns(index)[0], fitted.space.columns(other)[0]]
            slope = np.array([h.coordinates[0].scale, found.coordinates[0].scale])
            half = _half(slope, columns, cov)
            total = own["F_s"].value + found.values(fitted.space.parts(fitted.x)[other])["F_C"]
            return {**own, "F_s": Interval(total, total - half, total + half, own["F_s"].unit)}
    return own


def with_total(
    own: dict[str, Interval], fitted: Fit, h: Hypothesis, cov: np.ndarray, column: int
) -> dict[str, Interval]:
    """What a term of dry friction adds, F_added, and all the dry friction of its node, F_C: the record knows the sum
    better than its parts."""
    added = own["F_C"]
    name = DRY[fitted.model.kind].get(h.node, "")
    if name not in fitted.space.names:
        return {"F_added": added, **own}
    i, dry = fitted.space.names.index(name), dry_friction(fitted.model.kind, fitted.model.base, h.node)
    slope = np.array([dry, h.coordinates[0].scale])
    half = _half(slope, [i, column], cov)
    total = dry + added.value
    return {"F_C": Interval(total, total - half, total + half, added.unit), "F_added": added}


def _half(slope: np.ndarray, columns: list[int], cov: np.ndarray) -> float:
    """Half the width of the interval of a sum of coordinates, each times its slope."""
    return Z90 * float(np.sqrt(max(slope @ cov[np.ix_(columns, columns)] @ slope, 0.0)))


def _turn(
    model: Model, h: Hypothesis, x: np.ndarray, i: int, cov: np.ndarray, values: dict[str, float]
) -> dict[str, Interval]:
    c = h.coordinates[i]
    amplitude, phase = c.name.split("|")
    size = float(np.hypot(x[i], x[i + 1])) or 1e-12
    along = np.array([x[i], x[i + 1]]) / size
    across = np.array([-along[1], along[0]])
    a = Z90 * c.scale * float(np.sqrt(max(along @ cov @ along, 0.0)))
    p = Z90 * float(np.sqrt(max(across @ cov @ across, 0.0))) / size
    A, phi = values[amplitude], values[phase]
    return {
        amplitude: Interval(A, A - a, A + a, parameter_unit(model, h, amplitude)),
        phase: Interval(phi, phi - p, phi + p, "rad"),
    }


def parameter_unit(model: Model, h: Hypothesis, name: str) -> str:
    """Unit of a term's parameter at its node."""
    return unit_at(model.kind, h.term, h.node, name, model.units)


def plant_unit(model: Model, name: str) -> str:
    """Unit of a plant's parameter."""
    if model.kind == "axis" and (unit := model.units.of(name)) is not None:
        return unit
    kind = model.kind
    info = PARAMETERS[kind].model_fields.get(name)
    extra = info.json_schema_extra if info is not None else None
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""
