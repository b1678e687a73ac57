"""Diagnosis restricted to a few terms; the whole library takes one to two minutes."""

import pytest

from rtctl.diagnose.search import extend


def only(patch: pytest.MonkeyPatch, *terms: str) -> None:
    """Restrict the library to the given terms while the patch is active."""
    every = extend.hypotheses
    patch.setattr(extend, "hypotheses", lambda *given: [h for h in every(*given) if h.term in terms])
