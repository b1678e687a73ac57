"""A better law for a machine, and its model beside a recording, for scripts and notebooks."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtctl.improve.improve import Improved
    from rtctl.watch.watch import Alarm


def improve(
    what: str | Path,
    config: str | Path | None = None,
    *,
    reference: str | Path | None = None,
    body: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> "Improved":
    """Improved law of a machine, as `rtctl improve` makes it: `config`, `reduction`, the remedies that were `tried`.

    what: a bundle that was diagnosed, the folder of a diagnosis, or a model.yaml. config: law and loop, where the model
    has none. reference: another motion. body: the body that shall follow.
    Raises UserError for what is none of these, NoAnswer where the machine does not run with the law that it has.
    """
    from rtctl.improve import found
    from rtctl.improve.improve import improve as improved

    given = [None if one is None else str(one) for one in (config, reference)]
    return improved(found.load(Path(what), *given), body, progress)


def watch(
    bundle: str | Path,
    *,
    model: str | Path | None = None,
    band: str | Path | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> "list[Alarm]":
    """Alarms of a recording, as `rtctl watch BUNDLE` tells them: where it departs from its model.

    model: a model.yaml in the place of the description. band: a file of the healthy machine's band; it is written where
    it does not exist. say: is told each sentence.
    Raises UserError for what is no recording of a machine, NoAnswer where it ends before a band is learned.
    """
    from rtctl.watch.recorded import watch_bundle

    own, healthy = (None if one is None else Path(one) for one in (model, band))
    return watch_bundle(Path(bundle), say, own, healthy)
