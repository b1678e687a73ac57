"""Remedies of a machine whose two drives pull in turn, and which accelerates its reels beside the command."""

from rtctl.cli.common import load_config
from rtctl.improve import found
from rtctl.improve.improve import improve


def test_the_disturbance_observer_of_the_reel_unit_takes_neither_the_reels_nor_the_other_drive_for_a_disturbance():
    r = improve(found.of_config(load_config("ivu", []), "a test"), written_too=False)
    tried = {one.remedy.kind: one for one in r.tried}
    assert tried["observer"].kept, tried["observer"].reason
    assert tried["observer"].after < 0.75 * tried["observer"].before
    assert r.reduction > 0.4
