"""Band files: the loaded band equals the learned band; a band of another machine is refused."""

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.watch.kept import identity, load_band, save_band


def test_band_file_round_trip(rehearsed, tmp_path):
    path = tmp_path / "band.json"
    save_band(path, rehearsed.band, "a")
    found = load_band(path, "a")
    for name, value in rehearsed.band._asdict().items():
        if name == "limits":
            np.testing.assert_array_equal(found.limits.h, value.h)
        elif name == "whitening":
            np.testing.assert_array_equal(found.whitening[0], value[0])
        else:
            np.testing.assert_array_equal(getattr(found, name), value)


def test_band_of_another_model_is_refused(rehearsed, tmp_path):
    path = tmp_path / "band.json"
    save_band(path, rehearsed.band, identity(rehearsed.case, None))
    other = {**rehearsed.case, "parameters": {"R1": 1.0}}
    with pytest.raises(UserError, match="another machine, config or model"):
        load_band(path, identity(other, None))


def test_model_identity_does_not_depend_on_the_law(rehearsed):
    config = {**rehearsed.case["config"], "law": {"kind": "another"}}
    assert identity({**rehearsed.case, "config": config}, None) == identity(rehearsed.case, None)


def test_file_without_a_band_is_refused(tmp_path):
    path = tmp_path / "band.json"
    path.write_text('{"format": 7, "band": {}}')
    with pytest.raises(UserError, match="is no band of `rtctl watch`"):
        load_band(path, "a")
