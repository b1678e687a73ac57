"""Replay of the law of a recording by rtctl: whether the config in case.json gives the recorded command.

A law that the simulation of a diagnosis cannot compute (see `unsaid`), or that changed during the recording, is checked
by the tick of the config, as `rtctl replay` recomputes it to the bit. Code that came with the recording is never run.
"""

from typing import NamedTuple

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import Bundle
from rtctl.trace.replay import replay_bundle

NEEDED = ("tick", "order", "link_age")  # columns of every recording by rtctl


def by_rtctl(bundle: Bundle) -> bool:
    """Whether rtctl made a recording: the case has a config, the table the columns of a tick."""
    return isinstance(bundle.case.get("config"), dict) and all(name in bundle.columns for name in NEEDED)


class LawReplay(NamedTuple):
    rows: int  # number of replayed rows; 0 where the replay failed
    identical: bool  # to the bit, in all written voltages
    words: str  # sentence without its full stop


def replayed_law(bundle: Bundle) -> LawReplay | None:
    """Comparison of the recorded voltages with those of the law of the config for the recorded readings.

    None where rtctl did not make the recording.
    """
    if not by_rtctl(bundle):
        return None
    try:
        found = replay_bundle(bundle)
    except (NoAnswer, UserError) as error:
        return LawReplay(0, False, f"the law of the config was not replayed: {error}")
    rows = len(found.rows)
    wrong = next((d for d in found.differences if d.column in found.written), None)
    if wrong is None:
        return LawReplay(
            rows, True, f"the law of the config, replayed, gives the recorded command to the bit ({rows} rows)"
        )
    version = "" if found.same_program else "; the recording is of another version of rtctl"
    return LawReplay(
        rows,
        False,
        f"the law of the config, replayed, does not give the recorded command: {wrong.column} differs from tick "
        f"{wrong.tick} ({wrong.t:g} s) on, by up to {wrong.largest:.3g} V{version}",
    )
