import numpy as np
import pytest

from rtctl.scope import spectra
from rtctl.scope.reduce import LONGEST_SPECTRUM, spectrum
from rtctl.scope.spectra import Spectra
from rtctl.scope.view import View
from rtctl.scope.viewer import SLOW, Viewer


@pytest.fixture
def computed(monkeypatch):
    """Number of transformed signals of each call."""
    counts, real = [], spectra.lines

    def count(values):
        if len(values):
            counts.append(len(values))
        return real(values)

    monkeypatch.setattr(spectra, "lines", count)
    return counts


def noise(t):
    return np.random.default_rng(1).standard_normal(len(t))


@pytest.mark.parametrize(("rows_there", "asked"), [(3000, 1000), (700, 1000), (20_000, 100_000), (4, 1000)])
def test_spectrum_is_that_of_the_newest_rows(history, rows, rows_there, asked):
    history.append(rows(0, rows_there, noise))
    f, level, there = Spectra().newest(history, ["u", "v"], asked, 1e-3, 50)
    assert there == min(rows_there, asked, LONGEST_SPECTRUM)
    expected = spectrum(history.take(("u", "v"), history.head - there, history.head), 1e-3, 50)
    assert np.array_equal(f, expected[0]) and np.array_equal(level, expected[1])


def test_spectrum_of_a_signal_is_shared_by_viewers_and_renewed_with_new_rows(history, rows, computed):
    shared = Spectra()
    history.append(rows(0, 3000, noise))
    one = shared.newest(history, ["u", "v"], 1000, 1e-3, 300)
    two = shared.newest(history, ["v", "u"], 1000, 1e-3, 80)  # of another width, in another order
    shared.newest(history, ["v", "t"], 1000, 1e-3, 300)
    assert computed == [2, 1]
    assert len(two[0]) < len(one[0]) and two[1][1].max() == one[1][0].max()
    shared.newest(history, ["u"], 500, 1e-3, 300)  # of other rows
    history.append(rows(3000, 10, noise))
    shared.newest(history, ["u"], 1000, 1e-3, 300)
    assert computed == [2, 1, 1, 1]


def test_all_viewers_get_their_spectra_in_one_frame(history, rows, computed, unpack):
    shared = Spectra()
    viewers = [Viewer(shared) for _ in range(3)]
    frames = []
    for turn in range(30):
        history.append(rows(turn * 100, 100, noise))
        if turn in (3, 7, 10):
            viewer = viewers[(3, 7, 10).index(turn)]
            viewer.start(history, 1000.0)
            viewer.look(View.model_validate({"kind": "spectrum", "signals": ("u",), "window": 1.0, "columns": 100}))
        made = [viewer.frame(turn) for viewer in viewers]
        frames += [(turn, unpack(frame)[0]["kind"]) for frame in made if frame is not None]
        for viewer in viewers:
            viewer.drawn()
    turns = [turn for turn in range(3, 30) if turn % SLOW["spectrum"] == 0]
    assert sorted({turn for turn, _ in frames}) == turns
    assert len(frames) > 2 * len(turns) and len(computed) == len(turns)
