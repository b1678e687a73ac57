"""`rtctl prove`: concealed cases generated, sealed, diagnosed, opened, scored."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


@app.command()
def prove(
    count: Annotated[int, typer.Option(metavar="N", min=1, help="How many cases.")] = 20,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="A case depends on the seed and its number alone.")] = 1,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the cases, diagnoses and scores go.")] = Path("proof"),
    plants: Annotated[
        str | None, typer.Option(metavar="LIST", help="Of ivu, ldu, axis; separated by commas. All if not given.")
    ] = None,
    machines: Annotated[
        bool, typer.Option("--machines", help="Described machines (belt, arm, hoist, ...) instead of the plants.")
    ] = False,
    topologies: Annotated[
        str | None, typer.Option(metavar="LIST", help="With --machines: which, separated by commas. All if not given.")
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Parallel processes.")] = 1,
    limit: Annotated[str, typer.Option("--limit", metavar="T", help="Longest time for a case, e.g. 600s.")] = "600s",
    generate_only: Annotated[bool, typer.Option("--generate-only", help="Write and seal the cases; stop.")] = False,
    heldout: Annotated[bool, typer.Option("--heldout", help="Record each machine a second time as well.")] = False,
    against: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Answers of an earlier version to these cases; the differences are printed."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the scores as JSON.")] = False,
) -> None:
    """Prove the diagnosis on machines whose missing physics is concealed from it.

    Cases of the same seed and number that are in DIR already are not generated again. Finished diagnoses are kept.

    Examples:

      rtctl prove --count 20 --seed 7

      rtctl prove --count 300 --seed 2026 --out /tmp/proof --jobs 2

      rtctl prove --machines --count 200 --seed 11 --out /tmp/machines --jobs 2

      rtctl prove --count 20 --seed 7 --out now --against before
    """
    import json

    from rtctl.cli import common
    from rtctl.config.errors import UserError
    from rtctl.proof import against as earlier
    from rtctl.proof import prove as proof
    from rtctl.proof.batch import PLANTS
    from rtctl.proof.machines import TOPOLOGIES

    longest = common.seconds(limit, "--limit")
    if machines and plants:
        raise UserError("--plants and --machines: give one; with --machines the choice is --topologies")
    if topologies and not machines:
        raise UserError("--topologies chooses among described machines; it needs --machines")
    which = _listed(topologies, TOPOLOGIES) if machines else _listed(plants, PLANTS)
    sha = proof.prepare(out, count, seed, which, jobs, heldout, lambda n, of: _note("generated", n, of), machines)
    typer.echo(f"{count} cases in {out}, answers sealed: sha256 {sha}", err=True)
    if generate_only:
        if json_:
            typer.echo(json.dumps({"folder": str(out), "cases": count, "seed": seed, "sha256": sha}))
        return
    proof.diagnose_all(out, jobs, lambda n, of: _note("diagnosed", n, of), limit=longest)
    result = proof.score_all(out)
    differ = [] if against is None else earlier.pairs(out, against)
    if json_:
        more = {} if against is None else {"against": [pair._asdict() for pair in differ]}
        typer.echo(json.dumps(result | more, sort_keys=True))
        return
    typer.echo(proof.words(result))
    if against is not None:
        typer.echo(earlier.words(differ))
    typer.echo(f"report: {out / proof.REPORT}")


def _listed(given: str | None, every: tuple[str, ...]) -> tuple[str, ...]:
    """Names of a comma-separated list; all names where no list is given."""
    return every if given is None else tuple(name.strip() for name in given.split(",") if name.strip())


def _note(word: str, n: int, of: int) -> None:
    typer.echo(f"\r{word} {n} of {of}" + ("\n" if n == of else ""), err=True, nl=False)
