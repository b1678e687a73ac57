"""`rtctl improve`: remedies for the effects that a diagnosis found, tested on the emulated machine."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rtctl.cli.common import JsonOption, ReferenceOption, load_config

app = typer.Typer(add_completion=False)


@app.command()
def improve(
    what: Annotated[
        Path,
        typer.Argument(
            metavar="RUN_OR_MODEL",
            help="A bundle that was diagnosed, the folder of a diagnosis, or a model.yaml.",
        ),
    ],
    config: Annotated[
        str | None,
        typer.Option("--config", metavar="YAML", help="Config with law and loop, for a model that has none."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE.yaml", help="Improved config; NAME-better.yaml if absent."),
    ] = None,
    reference: ReferenceOption = None,
    body: Annotated[
        str | None,
        typer.Option(
            "--body",
            metavar="BODY",
            help="Body that must follow the reference; the last one that no drive acts on if absent.",
        ),
    ] = None,
    closed_loop: Annotated[
        str | None,
        typer.Option(
            "--closed-loop",
            metavar="CONFIG",
            help="Run the machine that this config reaches, before and after; recordings go beside FILE.yaml.",
        ),
    ] = None,
    learn: Annotated[
        int,
        typer.Option("--learn", metavar="N", min=0, max=50, help="With --closed-loop: runs of iterative learning."),
    ] = 0,
    report: Annotated[bool, typer.Option(help="Write FILE.html beside the config.")] = True,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    json: JsonOption = False,
) -> None:
    """Propose a remedy for each effect that a diagnosis found, and test it on the emulated fitted model. A remedy is
    kept where the machine follows its reference better, at both ends of the interval of the effect's size and with 6 dB
    and 45 degrees of margin. Writes the improved config, which `rtctl run` takes unchanged, and a report: before and
    after, what was given up, and what was left out and why.

    With --closed-loop the machine of CONFIG is tested as well, by its own sensor: with its former law, with the
    improved law, and with --learn N in N more runs, each of which learns from the run before.

    Exit code 3 where no comparison is possible: the emulated machine trips with its former law.

    Examples:

      rtctl improve runs/belt-20250102-101500 -o better.yaml

      rtctl improve model.yaml --config ivu.yaml --reference steps -o better.yaml

      rtctl improve model.yaml --closed-loop bench.yaml --learn 6 -o better.yaml
    """
    from rtctl.cli.diagnose_console import DiagnoseConsole
    from rtctl.cli.tune import check_files, write
    from rtctl.config.errors import UserError
    from rtctl.improve import found, words
    from rtctl.improve.improve import improve as improved

    start = found.load(what, config, reference)
    file = out or Path(f"{start.config.name}-better.yaml")
    page = file.with_suffix(".html")
    check_files(file, [file.with_suffix(".png")], force)
    if report and page.exists() and not force:
        raise UserError(f"--out {file}: {page} exists; give another name, or --force")
    if learn and closed_loop is None:
        raise UserError("--learn: goes with --closed-loop CONFIG; a move is learned on the machine that runs")
    machine = None if closed_loop is None else load_config(closed_loop, None)
    proof: Any = None
    with DiagnoseConsole(json).stages() as progress:
        r = improved(start, body, progress)
        if machine is not None:
            from rtctl.improve.closed_loop import prove

            proof = prove(r, machine, file.with_suffix(""), learn, progress)
            r = r._replace(config=r.config.model_copy(update={"law": proof.config.law}))
    running = None if proof is None else words.rows(r.config, proof.before, proof.after)
    write(file, text(r))
    if report:
        from rtctl.improve.report import html

        write(page, html(r, running))
    if json:
        from rtctl.cli.common import print_json
        from rtctl.diagnose.answer.results import finite

        found_words = {"config": str(file), "report": str(page) if report else None, **words.as_json(r)}
        if proof is not None:
            runs = zip(proof.names, proof.bundles, proof.figures, strict=True)
            found_words["closed_loop"] = [
                {"run": name, "bundle": str(bundle), **figures._asdict()} for name, bundle, figures in runs
            ]
        print_json(finite(found_words))
        return
    from rich.console import Console

    from rtctl.improve.report import terminal

    Console(highlight=False).print(terminal(r, running))
    typer.echo("  ".join(map(str, [file, *([page] if report else [])])))


def text(r: Any) -> str:
    """YAML of the improved config, after comments with the remedies and the conditions that must hold."""
    from rtctl.config.load import set_path, to_yaml
    from rtctl.improve import words

    head = [f"{r.config.name}, improved by `rtctl improve` from {r.found.source}.", words.headline(r)]
    head += [f"  {title}, against {against}: {size}" for title, against, size, *_ in words.kept_rows(r)]
    head += words.notes(r)
    made = set_path(r.config, "loop.mode", r.mode)
    return "".join(f"# {line}\n" for line in head) + to_yaml(made)
