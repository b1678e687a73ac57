"""A diagnosis in a notebook: what is missing, as words, a table, a report, and files."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from rtctl.api_progress import Stage, stages
from rtctl.trace.bundle import Bundle
from rtctl.trace.notebook import extra

HIGH = 900  # px of a report in a cell


class Report:
    """The page of a diagnosis: a cell shows it, `html` is its text, `save` writes it."""

    def __init__(self, html: str) -> None:
        self.html = html

    def save(self, path: str | Path) -> Path:
        """Write the page. Raises UserError where the disk does not take it."""
        from rtctl.config.files import write_text

        write_text(Path(path), self.html)
        return Path(path)

    def __repr__(self) -> str:
        return f"<Report, {len(self.html) / 1e3:.0f} kB of HTML; .save('report.html') writes it>"

    def _repr_html_(self) -> str:
        return f"<iframe srcdoc='{escape(self.html, quote=True)}' style='width:100%;height:{HIGH}px;border:0'></iframe>"


class Diagnosis:
    """What recordings say that their owner's model lacks.

    `verdict` is named, ambiguous, unnamed or nothing; `headline` says it in words. `effects` have `name`, `node`,
    `confidence` (0 to 1) and `parameters` with `value`, `low` and `high`, SI. `experiment` tells two answers apart.
    `found` is the whole of it, whose fields may change.
    """

    def __init__(self, found: Any) -> None:
        self.found = found

    verdict = property(lambda self: self.found.verdict, doc="named, ambiguous, unnamed or nothing")
    headline = property(lambda self: self.found.headline, doc="The verdict in one sentence or two.")
    effects = property(lambda self: self.found.effects, doc="What is missing, the surest first.")
    located = property(lambda self: self.found.located, doc="Where something without a name is; None elsewhere.")
    parameters = property(lambda self: self.found.parameters, doc="Numbers of the machine with intervals, by path, SI.")
    heldout = property(lambda self: self.found.heldout, doc="Error of held-out rows before and after.")
    experiment = property(lambda self: self.found.experiment, doc="What to run next; None where nothing is open.")
    cannot_test = property(lambda self: self.found.cannot_test, doc="Effects that this recording could not show.")
    seconds = property(lambda self: self.found.seconds, doc="Time that it took, s.")

    def as_json(self) -> dict[str, Any]:
        """diagnosis.json as plain data; what is not finite is None."""
        from rtctl.diagnose.answer.results import finite

        return dict(finite(self.found.as_json()))

    def to_pandas(self) -> Any:
        """A row for each parameter of each effect, SI. Raises UserError without pandas."""
        rows = [
            {"effect": e.name, "node": e.node, "confidence": e.confidence, "parameter": name, "value": size.value,
             "low": size.low, "high": size.high, "unit": size.unit}
            for e in self.effects for name, size in e.parameters.items()
        ]  # fmt: skip
        columns = ("effect", "node", "confidence", "parameter", "value", "low", "high", "unit")
        return extra("pandas").DataFrame(rows, columns=list(columns))

    def report(self, path: str | Path | None = None) -> Report:
        """The page with words, figures and tables, written to `path` as well where one is given."""
        from rtctl.diagnose.answer.report import html

        made = Report(html(self.found))
        if path is not None:
            made.save(path)
        return made

    def save(self, folder: str | Path, report: bool = True) -> list[str]:
        """Write diagnosis.json, model.yaml, report.html and, where two answers are open, experiment.yaml.

        Returns a sentence on each file that could not be made. Raises UserError where the disk does not take them.
        """
        from rtctl.diagnose.answer.files import write

        return list(write(self.found, Path(folder), report))

    def __repr__(self) -> str:
        names = ", ".join(f"{e.name} at {e.node} ({100 * e.confidence:.0f} %)" for e in self.effects)
        return f"<Diagnosis: {self.verdict}{f', {names}' if names else ''}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(e.name)}</td><td>{escape(e.node)}</td><td>{100 * e.confidence:.0f} %</td><td>"
            + ", ".join(f"{escape(k)} = {v.value:.4g} ({v.low:.4g} to {v.high:.4g}) {escape(v.unit)}" for k, v in
                        e.parameters.items())
            + "</td></tr>"
            for e in self.effects
        )  # fmt: skip
        head = "<tr><th>effect</th><th>at</th><th>sure</th><th>size</th></tr>"
        table = f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>" if rows else ""
        return f"<p><b>{escape(self.verdict)}</b>: {escape(self.headline)}</p>{table}"


def diagnose(
    *what: Bundle | str | Path,
    heldout: Bundle | str | Path | None = None,
    together: bool = False,
    out: str | Path | None = None,
    machine: str | Path | None = None,
    progress: bool | Stage = True,
) -> Diagnosis:
    """Find the physics that the owner's model lacks, in a recording or in several of one machine.

    what: bundles or their folders; several are of one machine by the `group` of their cases, or with `together`.
    heldout: a second recording that is predicted. out: folder for the files of `rtctl diagnose`; none if absent.
    machine: your config that names the file of the machine's mechanics, which no bundle may bring.
    progress: a bar in a notebook or on a terminal, or a function that hears each stage.
    Raises UserError for a bundle that cannot be read, NoAnswer for one that supports no verdict.
    """
    from rtctl.config.errors import UserError
    from rtctl.diagnose.answer import answer
    from rtctl.diagnose.answer.second import predicted
    from rtctl.diagnose.bundles import of_one_machine

    folders = _folders(what)
    if not folders:
        raise UserError("rtctl.diagnose() needs a bundle: rtctl.diagnose('runs/a')")
    if len(folders) > 1:
        of_one_machine(folders, together)
    if machine is not None:
        from rtctl.own.mechanics import give_machine

        give_machine(Path(machine))
    with stages(progress) as stage:
        found = answer.diagnose(*folders, progress=stage)
        if heldout is not None:
            stage("predicting the second recording")
            found = predicted(found, *_folders([heldout]))
        made = Diagnosis(found)
        if out is not None:
            stage("writing the results")
            made.save(out)
    return made


def _folders(what: Sequence[Bundle | str | Path]) -> list[Path]:
    return [one.folder if isinstance(one, Bundle) else Path(one) for one in what]


def diagnosis(folder: str | Path, other: str | Path | None = None) -> Any:
    """The former name of `diagnose`, without a bar. Goes in version 0.2."""
    import warnings

    warnings.warn("rtctl.diagnosis() is rtctl.diagnose() now and goes in version 0.2", DeprecationWarning, stacklevel=2)
    return diagnose(folder, *([] if other is None else [other]), together=other is not None, progress=False)
