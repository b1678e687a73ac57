"""Parts of case.json that machines share: numbers of settings, and the law of the position."""

from typing import Any

from rtctl.own.files import is_own


def given(settings: Any) -> dict[str, float]:
    """Numbers among the settings, by name."""
    return {k: v for k, v in settings.model_dump().items() if isinstance(v, (int, float)) and v is not None}


def position(law: Any) -> dict[str, Any]:
    """Key `controller`: the law of the position; `unknown` for a law in a user's file."""
    p = law.position
    kind = getattr(p, "kind", "pd")
    if is_own(kind):
        return {"kind": "unknown"}
    if kind == "pd":
        return {"kind": "pd", "P": p.gain, "D": p.gain * p.tau_d, "derivative_filter_hz": p.derivative_filter}
    return {"kind": kind, **p.model_dump(mode="json", exclude={"kind"})}


def unit_row(n: int, i: int) -> Any:
    """Row i of the unit matrix (n, n)."""
    import numpy as np

    return np.eye(n)[i]
