"""Recordings in and out, models against them, experiments, and the library of effects, for scripts and notebooks."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError, nearest
from rtctl.trace.bundle import Bundle, load_bundle
from rtctl.trace.notebook import extra, in_cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.trace.export import Exported

OWNER = "case"


class Note(UserWarning):
    """What an import assumed or passed over."""


def import_recording(
    file: str | Path,
    out: str | Path,
    *,
    machine: str | Path | None = None,
    plant: str | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    rate: float | str | None = None,
    parameters: Mapping[str, float | str] | None = None,
    case: Mapping[str, Any] | None = None,
    uneven: bool = False,
    text: Mapping[str, Any] | None = None,
) -> Bundle:
    """Bundle made in `out` of a file of another program, as `rtctl import` makes it.

    file: csv, mat, npz, parquet, json, mcap, mf4, tdms or hdf5.
    machine: description of the machine (YAML), or plant: axis, ivu, ldu. columns: our name -> theirs. units: our name
    -> unit in the file. parameters, case: of case.json, `{"drive": {"newton_per_volt": 35.15}}`. text: where what
    stands in a file of text, `{"decimal": ","}`. What was assumed is told as warnings of the category Note.
    Raises UserError where the file or what is said of it is wrong.
    """
    from rtctl.trace.imports import read
    from rtctl.trace.imports.make import make_bundle
    from rtctl.trace.imports.plan import plan_of

    given: dict[str, Any] = {
        "columns": {name: {"column": theirs} for name, theirs in (columns or {}).items()},
        "parameters": dict(parameters or {}), "case": dict(case or {}), "uneven": uneven, "text": dict(text or {}),
    }  # fmt: skip
    for name, unit in (units or {}).items():
        given["columns"].setdefault(name, {})["unit"] = unit
    given |= {key: value for key, value in (("plant", plant), ("rate", rate)) if value is not None}
    plan = plan_of(given)
    if machine is not None:
        from rtctl.plants.graph.file import read_machine
        from rtctl.trace.imports.described import make_described

        made = make_described(read(Path(file), plan.text), plan, read_machine(Path(machine)), Path(out))
    else:
        made = make_bundle(read(Path(file), plan.text), plan, Path(out))
    for note in made.notes:
        warnings.warn(note, Note, stacklevel=2)
    return load_bundle(made.folder)


def export(
    bundle: Bundle | str | Path,
    to: str,
    out: str | Path | None = None,
    *,
    columns: Sequence[str] = (),
    start: float = -np.inf,
    end: float = np.inf,
    every: int = 1,
) -> "Exported":
    """A bundle as a file of another program: csv, mat, parquet, mcap, mcap-json, rrd, mf4, tdms.

    out: the file, `trace.*` in the bundle if absent. columns: all if empty; `t` always comes along. start, end: s of
    `t`. every: one row of so many, without a filter. Returns path, rows, columns and bytes. Raises UserError.
    """
    from rtctl.trace.export import Selection
    from rtctl.trace.export import export as write

    return write(_folder(bundle), to, out, Selection(tuple(columns), float(start), float(end), every))


class Simulation:
    """A free run of a model beside the recording.

    `t` is in s; `recorded[name]` and `simulated[name]` are arrays (n,), `rmse[name]` and `nrmse[name]` their distance,
    `closed` whether a law closed the loop.
    """

    def __init__(self, result: Any) -> None:
        self.result = result
        self.t, self.closed = result.t, result.closed
        self.recorded = {name: c.recorded for name, c in result.channels.items()}
        self.simulated = {name: c.simulated for name, c in result.channels.items()}
        self.rmse = {name: c.rmse for name, c in result.channels.items()}
        self.nrmse = {name: c.nrmse for name, c in result.channels.items()}
        self.units = {name: c.unit for name, c in result.channels.items()}

    def plot(self) -> "Figure":
        """Recorded, simulated and error of every channel."""
        from rtctl.cli.simulate import figure

        return in_cell(figure(self.result))

    def to_pandas(self) -> Any:
        """A DataFrame by time: `name` recorded and `name_simulated`. Raises UserError without pandas."""
        columns = {"t": self.t}
        for name in self.recorded:
            columns |= {name: self.recorded[name], f"{name}_simulated": self.simulated[name]}
        return extra("pandas").DataFrame(columns).set_index("t")

    def __repr__(self) -> str:
        told = ", ".join(f"{n} rmse {self.rmse[n]:.4g} {self.units[n]}".rstrip() for n in self.rmse)
        return f"<Simulation, {self.result.mode}: {told}>"


def simulate(
    model: str | Path, bundle: Bundle | str | Path, *, closed: bool | None = None, skip: int = 0
) -> Simulation:
    """Free run of a model over a recording.

    model: a config or model.yaml, the name of one that comes with rtctl, or "case" for what the recording's owner
    believes. closed: from the reference with its own law (True) or from the recorded command (False); closed where the
    law is known if absent. skip: rows at the start that do not count. Raises UserError, NoAnswer where it runs away.
    """
    from rtctl.diagnose.answer.believe import check_believed
    from rtctl.diagnose.answer.freerun import compare
    from rtctl.diagnose.answer.load import of_bundle

    whole = bundle if isinstance(bundle, Bundle) else load_bundle(bundle)
    record = of_bundle(whole, None if str(model) == OWNER else str(model))
    if str(model) == OWNER:
        check_believed(record)
    return Simulation(compare(record, closed, skip, whole))


EXPERIMENTS = ("frf", "friction", "steps")


def identify(what: str, *source: Any, say: Any = lambda _: None) -> Any:
    """Result of an experiment: "frf" (sensitivity and process at frequencies), "friction" (force by speed), or "steps".

    source: bundles of the experiment or their folders, or one config (a name, a file, or settings) with which it is
    played, emulated machines on virtual time. say: hears what is played. `rtctl identify` has more experiments.
    Returns Sensitivity, Friction or a list of Steps. Raises UserError, NoAnswer where the data carry no answer.
    """
    from rtctl.identify import experiment, friction, sensitivity, steps

    if what not in EXPERIMENTS:
        near = nearest(what, EXPERIMENTS)
        raise UserError(
            f"no experiment '{what}'; " + (f"did you mean '{near}'?" if near else f"there is {', '.join(EXPERIMENTS)}")
        )
    plans = {
        "frf": lambda config: experiment.noise(config, 50),
        "friction": lambda config: [friction.break_away_config(config), friction.velocity_config(config)],
        "steps": steps.usual_configs,
    }
    records = _records(source, plans[what], say)
    if what == "frf":
        return sensitivity.identify(records)
    if what == "friction":
        points, refused = friction.points_of(records)
        return friction.friction(points, refused, records[0].kind)
    return [steps.steps(record) for record in records]


def _records(source: Sequence[Any], plan: Any, say: Any) -> list[Any]:
    from rtctl.cli import common, identify_source
    from rtctl.identify.records import take_all

    if not source:
        raise UserError("rtctl.identify() needs bundles, or one config: rtctl.identify('friction', 'ldu')")
    if all(isinstance(one, Bundle) for one in source):
        return list(take_all(list(source)))
    if len(source) == 1 and not isinstance(source[0], str | Path | Bundle):
        config = source[0]
    else:
        words = [str(_folder(one)) for one in source]
        if identify_source.are_bundles(words):
            return list(take_all(identify_source.load(words)))
        config = common.load_config(words[0], None)
    return list(take_all(identify_source.play(config, plan(config), None, say)))


class Effect(NamedTuple):
    """A term of the library: what it is, its equation, what it is mistaken for, and what to look at on the machine."""

    name: str
    words: str
    equation: str
    source: str
    parameters: dict[str, str]  # name -> unit
    look_alikes: dict[str, str]  # name -> experiment that tells the two apart
    check: str

    def __repr__(self) -> str:
        return f"<Effect {self.name}: {self.words}>"


class Library(dict[str, Effect]):
    """Effects by name; a cell shows them as a table."""

    def __repr__(self) -> str:
        return f"<{len(self)} effects: {', '.join(self)}>"

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(e.name)}</td><td>{escape(e.words)}</td><td>{escape(e.equation)}</td></tr>"
            for e in self.values()
        )
        return (
            f"<table><thead><tr><th>effect</th><th>is</th><th>equation</th></tr></thead><tbody>{rows}</tbody></table>"
        )


def physics(name: str | None = None) -> Any:
    """The library of effects that a diagnosis can name and a `physics:` list can hold, by name; or one of them.

    Raises UserError for a name that is not in it.
    """
    from rtctl.plants.physics import TERMS

    if name is None:
        return Library({key: _effect(term) for key, term in TERMS.items()})
    if name not in TERMS:
        near = nearest(name, TERMS)
        raise UserError(
            f"no effect '{name}'; " + (f"did you mean '{near}'?" if near else "rtctl.physics() has them all")
        )
    return _effect(TERMS[name])


def _effect(term: Any) -> Effect:
    units = {
        key: str((field.json_schema_extra or {}).get("unit", ""))
        for key, field in term.settings.model_fields.items() if key not in ("term", "node")
    }  # fmt: skip
    return Effect(term.name, term.words, term.equation, term.source, units, dict(term.look_alikes), term.check)


def _folder(bundle: Any) -> Any:
    return bundle.folder if isinstance(bundle, Bundle) else bundle
