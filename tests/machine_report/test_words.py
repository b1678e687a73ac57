"""Machine report: text, modes and drawings."""

import xml.etree.ElementTree as ET

import fused
import numpy as np
import pytest

from rtctl.machine_report import grid, modes, svg, terminal, words

NAMES = sorted(path.stem for path in (fused.CONFIGS / "machines").glob("*.yaml"))


def machine(name, **changes):
    return fused.config(f"machines/{name}", **changes).machine


def test_report_text_has_units_and_names():
    lines = [line for _, line in words.sentences(machine("belt"))]
    assert lines[0] == "motor turns, 2.1e-05 kg m^2, dry friction 4 mNm, viscous friction 10 uNm s/rad"
    assert lines[2] == "belt is a spring from motor to carriage, ratio 12.7 mm/rad, 80 kN/m, damping 35 N s/m"
    assert lines[3] == "amplifier drives motor by u: 30 mNm for 1 V, at most 10 V"
    assert lines[5] == "scale shows the position of carriage in scale_counts, one step is 10 um"


def test_modes_of_two_masses_on_a_spring():
    J, m, k, r = 2.1e-5, 1.4, 8e4, 0.0127
    found = [mode for mode in modes.modes_of(machine("belt")) if mode.hertz]
    assert len(found) == 1
    assert found[0].hertz == pytest.approx(np.sqrt(k * (r * r / J + 1 / m)) / 2 / np.pi, rel=1e-3)
    assert found[0].damping == pytest.approx(35 / 2 * np.sqrt((r * r / J + 1 / m) / k), rel=1e-2)


def test_pendulum_is_stable_hanging_and_unstable_upright():
    hanging = modes.modes_of(machine("arm"))[0]
    assert hanging.hertz == pytest.approx(np.sqrt(2.5 * 9.80665 * 0.25 / 0.65) / 2 / np.pi, rel=0.03)
    lines = modes.sentences(machine("arm", machine__bodies__arm__gravity__angle="180 deg"))
    assert any(line.startswith("falls away") for line in lines)


def test_drive_dynamics_add_modes():
    assert "400 Hz, damping 0.707: the drive" in modes.sentences(machine("screw"))


@pytest.mark.parametrize("name", NAMES)
def test_both_drawings_show_every_element_once(name):
    described = machine(name)
    text, picture = "\n".join(terminal.drawing(described)), svg.svg(described, name)
    shown = [node.text for node in ET.fromstring(picture).iter("{http://www.w3.org/2000/svg}text")]
    for element in (*described.bodies, *described.joints):
        assert element in text and shown.count(element) == 1 + (element == name)
    for element in (*described.drives, *described.sensors):
        assert f"{element} (" in text and sum(f"{element} (" in words for words in shown) == 1


@pytest.mark.parametrize("name", NAMES)
def test_bodies_do_not_overlap_in_a_drawing(name):
    places = grid.grid(machine(name)).places
    assert len(set(places.values())) == len(places)
