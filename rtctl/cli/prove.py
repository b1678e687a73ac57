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
    plants: Annotated[str, typer.Option(metavar="LIST", help="Of ivu, ldu, axis; separated by commas.")] = (
        "ivu,ldu,axis"
    ),
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Processes side by side.")] = 1,
    limit: Annotated[str, typer.Option("--limit", metavar="T", help="Longest time for a case, e.g. 600s.")] = "600s",
    generate_only: Annotated[bool, typer.Option("--generate-only", help="Write and seal the cases; stop.")] = False,
    heldout: Annotated[bool, typer.Option("--heldout", help="Record each machine a second time as well.")] = False,
    json_: Annotated[bool, typer.Option("--json", help="Print the scores as JSON.")] = False,
) -> None:
    """Prove the diagnosis on machines whose missing physics is concealed from it.

    Cases that are in DIR already, of the same seed and number, are not generated again, and those diagnosed already
    not diagnosed again.

    Examples:

      rtctl prove --count 20 --seed 7

      rtctl prove --count 300 --seed 2026 --out /tmp/proof --jobs 2
    """
    import json

    from rtctl.cli import common
    from rtctl.proof import prove as proof

    longest = common.seconds(limit, "--limit")
    which = tuple(p.strip() for p in plants.split(",") if p.strip())
    sha = proof.prepare(out, count, seed, which, jobs, heldout, lambda n, of: _note("generated", n, of))
    typer.echo(f"{count} cases in {out}, answers sealed: sha256 {sha}", err=True)
    if generate_only:
        if json_:
            typer.echo(json.dumps({"folder": str(out), "cases": count, "seed": seed, "sha256": sha}))
        return
    proof.diagnose_all(out, jobs, lambda n, of: _note("diagnosed", n, of), limit=longest)
    result = proof.score_all(out)
    if json_:
        typer.echo(json.dumps(result, sort_keys=True))
    else:
        typer.echo(proof.words(result))
        typer.echo(f"report: {out / proof.REPORT}")


def _note(word: str, n: int, of: int) -> None:
    typer.echo(f"\r{word} {n} of {of}" + ("\n" if n == of else ""), err=True, nl=False)
