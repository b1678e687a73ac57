"""Remedies of the reel unit: two drives that pull alternately, reels that are accelerated by the law."""

from rtctl.cli.common import load_config
from rtctl.improve import found
from rtctl.improve.improve import improve


def test_disturbance_observer_of_the_reel_unit_excludes_reel_inertia_and_the_other_drive():
    r = improve(found.of_config(load_config("ivu", []), "a test"), written_too=False)
    tried = {one.remedy.kind: one for one in r.tried}
    assert tried["observer"].kept, tried["observer"].reason
    assert tried["observer"].after < 0.75 * tried["observer"].before
    assert r.reduction > 0.4
