"""Which channels of a board each machine uses, and what its drives and sensors are called there.

The order is that of the codes in the link's frame, and the same for an emulated board, a real one and an FMU.
"""

from typing import Any

from rtctl.config.errors import UserError
from rtctl.drivers.board import Wiring
from rtctl.machines.profile import Terminals
from rtctl.machines.profiles import PROFILES, profile_of

TERMINALS: dict[str, Terminals] = {kind: profile.terminals for kind, profile in PROFILES.items()}


def wiring(config: Any) -> Wiring:
    """Channels that a machine's config uses. Raises UserError where nobody has said them."""
    wired = profile_of(config.kind).wiring
    if wired is None:
        raise UserError(f"{config.name}: a machine of kind {config.kind} has no wires to a board")
    return wired(config)
