"""Test of the library's laws on the proof's machines: residuals in units of noise.

    rtctl prove --machines --count 60 --seed S --generate-only --out FOLDER
    python benchmarks/laws.py FOLDER [--json]

A generated recording with one concealed effect is fitted with this effect in each of its forms, without a search. The
residual is compared with the known noise of the generator. A ratio of 1 means that the law equals that of the machine.
A much larger ratio means a form missing in the library, a reading off by a part of a tick, or a fit in a local minimum.
A diagnosis then needs a false second name. Recordings without a concealed effect are evaluated with their true numbers:
the residual is the error of the simulation and the random force on the machine.

Prints for each case the residual of the nominal model and of the law, for the worst sensor; with --json {"cases",
"median", "p90", "worst"} of the law.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.diagnose.answer.load import load
from rtctl.diagnose.likelihood.fits import Fitted, refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.search.enrich import enriched
from rtctl.diagnose.search.hypotheses import hypotheses

PLAIN = ("null", "parameters")  # kinds of cases without a concealed effect


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="cases of `rtctl prove --machines`, with answers.json")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = []
    for name, answer in sorted(json.loads((given.folder / "answers.json").read_text())["cases"].items()):
        if answer["kind"] not in (*PLAIN, "single"):
            continue
        before, after, what = judged(given.folder / name, answer)
        if after is None:
            continue
        found.append(after)
        print(f"{name} {answer['topology']:10} {what:40} {before:8.2f} {after:8.2f}", file=sys.stderr, flush=True)
    figures = {key: float(np.quantile(found, q)) if found else None for key, q in (("median", 0.5), ("p90", 0.9))}
    figures["worst"] = max(found, default=None)
    print(json.dumps({"cases": len(found), **figures}) if given.json else f"{len(found)} cases, {figures}")


def judged(bundle: Path, answer: dict[str, Any]) -> tuple[float, float | None, str]:
    """Residuals in noise units of the nominal model and of the concealed law, and the name of the effect.

    The second residual is None for a law that is not searched at any element of this machine.
    """
    like, space = together([load(bundle)])
    if answer["kind"] in PLAIN:
        model = space.model(space.start())
        known = {path: value for path, value in answer["true_parameters"].items() if path in model.base}
        before, after = (like.raw(m) for m in (model, model._replace(base=model.base | known)))
        return left(like, before, answer), left(like, after, answer), answer["kind"]
    base = refit(like, space)
    effect = answer["effects"][0]
    best: Fitted | None = None
    for h in hypotheses(like.parts[0].sim, base.model):
        if h.term in effect.get("names_ok", [effect["name"]]) and h.node in effect.get("nodes_ok", [effect["node"]]):
            for own in (h.start(), np.where(h.start() == 0.0, 1.0, h.start())):  # at 1 a limit is active
                f = refit(like, space.add(h), np.concatenate([base.x, own]))
                best = f if best is None or f.log_evidence > best.log_evidence else best
    after = None if best is None else left(like, enriched(best).e, answer)
    return left(like, base.e, answer), after, f"{effect['name']} at {effect['node']}"


def left(like: Likelihood, e: np.ndarray, answer: dict[str, Any]) -> float:
    """Residual over the known noise of the generator, of the worst sensor; `e` (blocks, sensors) in SI."""
    sim, out = like.parts[0].sim, []
    for c, name in enumerate(sim.channels):
        sensor = sim.case.machine.sensors.get(name)
        floor = answer["noise_floor"].get(sensor.column) if sensor is not None else None
        if sensor is not None and floor:
            counts = sensor.counts_per_unit or sensor.per_unit
            out.append(float(np.std(e[:, c])) * abs(counts) * np.sqrt(like.mean) / floor)
    return max(out, default=float("nan"))


if __name__ == "__main__":
    main()
