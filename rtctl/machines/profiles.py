"""Profiles of the machines that have one, by kind."""

from collections.abc import Iterable

from rtctl.machines import axis_profile, ivu_profile, ldu_profile
from rtctl.machines.profile import Profile

PROFILES = {profile.kind: profile for profile in (ivu_profile.PROFILE, ldu_profile.PROFILE, axis_profile.PROFILE)}
NONE = Profile()


def profile_of(kind: str) -> Profile:
    """Profile of a kind of machine; one without traits where the machine has none."""
    return PROFILES.get(kind, NONE)


def kinds_with(*traits: str) -> Iterable[str]:
    """Kinds of machine that have one of the traits."""
    return (kind for kind, profile in PROFILES.items() if profile.traits.intersection(traits))
