"""Terms of physics, one file a family. Emulator, fit and diagnosis all use these and no others."""

from rtctl.plants.physics import friction
from rtctl.plants.physics.term import Term

TERMS: dict[str, Term] = {term.name: term for term in (friction.COULOMB, friction.VISCOUS, friction.STRIBECK)}
