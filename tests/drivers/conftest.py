import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rtctl.drivers.at_mio_16de import AnalogInputSettings, AnalogOutputSettings
from rtctl.drivers.board import Wiring

sys.path.insert(0, str(Path(__file__).parent))  # for rigs.py and daqmx_card.py, under importlib mode

WIRING = Wiring(
    outputs=(AnalogOutputSettings(channel=0), AnalogOutputSettings(channel=1)),
    inputs=(
        AnalogInputSettings(channel=0, polarity="unipolar"),
        AnalogInputSettings(channel=1, polarity="bipolar"),
    ),
    counters=2,
    lines=(2,),
)


@pytest.fixture(scope="session")
def comedi_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library with the C signatures of libcomedi and an emulated card."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler (cc) here")
    out = tmp_path_factory.mktemp("comedi") / "libcomedi.so"
    source = Path(__file__).with_name("comedi_card.c")
    subprocess.run([compiler, "-Wall", "-Werror", "-O1", "-shared", "-fPIC", source, "-o", out, "-lm"], check=True)
    return out


@pytest.fixture(scope="session")
def serial_library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The compiled C code of examples/serial_board/."""
    import serial_device

    return serial_device.library(tmp_path_factory.mktemp("serial"))


@pytest.fixture
def rig(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """`rig("comedi", wiring)`: an unopened card with its wires."""
    import rigs

    made = []

    def make(kind: str, wiring: Wiring = WIRING, **settings: Any) -> Any:
        if kind == "emulated":
            found = rigs.emulated(wiring)
        elif kind == "can":
            found = rigs.can(wiring, **settings)
        elif kind == "serial":
            found = rigs.serial(wiring, request.getfixturevalue("serial_library"), **settings)
        elif kind.startswith("comedi"):
            library = request.getfixturevalue("comedi_library")
            number = int(kind == "comedi of 16 bits")
            if number:
                settings.setdefault("encoders", "quadrature")
            found = rigs.comedi(wiring, library, number, **settings)
        else:
            pytest.importorskip("nidaqmx", reason="nidaqmx is not installed")
            found = rigs.daqmx(wiring, monkeypatch, **settings)
        made.append(found)
        return found

    yield make
    for found in made:
        found.card.close()
        found.end()
