"""Descriptions in files: below `machine` in a config, or alone in a file."""

import pytest

from rtctl.config.errors import UserError
from rtctl.plants.graph.file import is_bare, read_machine

BARE = """\
bodies:
  arm: {inertia: 0.03 kg*m^2}
sensors:
  encoder: {body: arm, column: x}
physics:
  - {term: friction.coulomb, node: arm, F_C: 20 mNm}
"""


@pytest.mark.parametrize(
    ("data", "bare"), [({"bodies": {}}, True), ({"mechanics": {}}, True), ({"machine": "ivu", "sensors": {}}, False),
                       ({"name": "x"}, False), (None, False)],
)  # fmt: skip
def test_bare_description_is_recognised(data, bare):
    assert is_bare(data) is bare


def test_known_effects_are_read_in_si_units(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(BARE)
    assert read_machine(file).physics == ({"term": "friction.coulomb", "node": "arm", "F_C": 0.02},)


def test_message_of_a_wrong_unit_has_file_and_line(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(BARE.replace("20 mNm", "20 N"))
    with pytest.raises(UserError, match=r"arm\.yaml:6: physics\.0\.F_C: '20 N' is not a quantity in Nm"):
        read_machine(file)


def test_mechanics_of_a_bare_description_are_read(tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(f"mechanics: {{kind: ./gone.py:Gone}}\n{BARE}")
    with pytest.raises(UserError, match="mechanics"):
        read_machine(file)
