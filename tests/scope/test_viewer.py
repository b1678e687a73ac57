import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.scope.reduce import envelope
from rtctl.scope.view import View, read_view
from rtctl.scope.viewer import OUTSTANDING, Viewer


@pytest.fixture
def viewer(history):
    made = Viewer()
    made.start(history, 1000.0)
    return made


def look(viewer, **view):
    viewer.look(View.model_validate({"signals": ("u",), "window": 1.0, "columns": 100, **view}))


def drawn(viewer):
    frame = viewer.frame()
    viewer.drawn()
    return frame


def noise(t):
    return np.random.default_rng(round(t[0] * 1000)).standard_normal(len(t))


@pytest.mark.parametrize("slow", [False, True])
def test_rolling_frames_contain_every_extreme_despite_dropped_frames(viewer, history, rows, unpack, slow):
    look(viewer, signals=("u", "v"), window=10.0)
    got = []
    for turn in range(60):
        history.append(rows(turn * 97, 97, noise))
        frame = viewer.frame()
        if frame is not None:
            about, arrays = unpack(frame)
            assert about["bucket"] == 100
            assert about["restart"] == (not got)
            got.append(arrays)
        if not slow or turn % 9 == 0:
            viewer.drawn()
    viewer.outstanding = 0
    rest = viewer.frame()
    got += [] if rest is None else [unpack(rest)[1]]
    assert (viewer.dropped > 10) == slow
    t, *values = np.concatenate(got, axis=1)
    low, high = envelope(history.take(("u", "v"), 0, 5800), 100)
    assert t.tolist() == (np.arange(58) / 10).tolist()
    assert np.array_equal(values, [*low, *high])


def test_viewer_without_acknowledgement_gets_no_frames_and_is_counted(viewer, history, rows):
    look(viewer)
    frames = []
    for turn in range(10):
        history.append(rows(turn * 50, 50))
        frames.append(viewer.frame())
    assert [frame is not None for frame in frames] == [True] * OUTSTANDING + [False] * (10 - OUTSTANDING)
    assert viewer.dropped == 10 - OUTSTANDING


def test_viewer_absent_longer_than_the_window_gets_the_window(viewer, history, rows, unpack):
    look(viewer)
    history.append(rows(0, 100))
    drawn(viewer)
    history.append(rows(100, 5000))
    about, (t, *_) = unpack(viewer.frame())
    assert about["restart"]
    assert (t[0], t[-1]) == (pytest.approx(4.1), pytest.approx(5.09))


def test_sweep_starts_before_its_crossing(viewer, history, rows, unpack):
    trigger = {"mode": "normal", "signal": "u", "level": 0.5, "pre": 0.25}
    look(viewer, trigger=trigger, window=0.1, columns=200)
    history.append(rows(0, 1050, lambda t: t >= 1.0))
    assert drawn(viewer) is None  # incomplete sweep
    history.append(rows(1050, 50, lambda t: t >= 1.0))
    about, (t, u) = unpack(viewer.frame())
    assert (about["kind"], about["sweep"], about["sweeps"]) == ("picture", True, 1)
    assert t == pytest.approx(np.arange(-25, 75) / 1000)
    assert u.tolist() == [0.0] * 25 + [1.0] * 75


def test_auto_mode_rolls_without_a_crossing(viewer, history, rows, unpack):
    trigger = {"mode": "auto", "signal": "u", "level": 0.5}
    look(viewer, trigger=trigger, window=0.1)
    history.append(rows(0, 200, lambda t: t >= 0.1))
    kinds = []
    for turn in range(40):
        frame = drawn(viewer)
        kinds += [] if frame is None else [unpack(frame)[0]["kind"]]
        history.append(rows(200 + 50 * turn, 50, lambda t: t >= 0.1))
    assert (kinds[0], kinds[-1]) == ("picture", "roll")


def test_held_rows_can_be_zoomed_after_they_are_overwritten(viewer, history, rows, unpack):
    look(viewer, window=2.0)
    history.append(rows(0, 5000, noise))
    drawn(viewer)
    expected = history.take(("t", "v"), 4000, 4011)  # one additional row on either side
    look(viewer, window=2.0, hold=True)
    history.append(rows(5000, 40_000))
    about, arrays = unpack(drawn(viewer))
    assert (about["held"], about["bucket"]) == (True, 20)
    assert drawn(viewer) is None  # no new frame
    look(viewer, window=2.0, hold=True, signals=("v",), span=(4.001, 4.009))
    about, arrays = unpack(drawn(viewer))
    assert about["bucket"] == 1
    assert np.array_equal(arrays, expected)


def test_single_sweep_stays_shown(viewer, history, rows, unpack):
    trigger = {"mode": "single", "signal": "u", "level": 0.5, "pre": 0.5}
    look(viewer, trigger=trigger, window=0.1, columns=200)
    history.append(rows(0, 2000, lambda t: t >= 1.0))
    assert unpack(drawn(viewer))[0]["done"]
    history.append(rows(2000, 60_000, lambda t: t % 2))
    assert drawn(viewer) is None
    look(viewer, trigger=trigger, window=0.1, columns=200, signals=("v",))
    assert unpack(drawn(viewer))[1][1].tolist() == list(range(-950, -1050, -1))
    look(viewer, trigger=trigger, window=0.1, columns=200, signals=("v",), hold=True, span=(0.0, 0.0105))
    assert unpack(drawn(viewer))[1][1].tolist() == list(range(-999, -1012, -1))
    look(viewer, trigger={**trigger, "armed": 1}, window=0.1, columns=200)
    assert drawn(viewer) is None  # waits for the next crossing


def test_xy_and_spectrum_views(viewer, history, rows, unpack):
    history.append(rows(0, 3000))
    look(viewer, kind="xy", x="v", signals=("u", "nothing"))
    frames = [frame for frame in (drawn(viewer) for _ in range(8)) if frame is not None]
    about, arrays = unpack(frames[0])
    assert (about["kind"], about["names"], arrays.shape) == ("xy", ["v", "u"], (2, 1000))
    assert len(frames) == 4  # every second frame
    look(viewer, kind="spectrum")
    about, arrays = unpack(next(frame for frame in (drawn(viewer) for _ in range(8)) if frame is not None))
    assert (about["kind"], about["rows"], arrays.shape[0]) == ("spectrum", 1000, 2)


def test_view_without_signals_is_valid(viewer, history, rows):
    history.append(rows(0, 3000))
    for kind in ("time", "xy", "spectrum"):
        look(viewer, kind=kind, signals=())
        for _ in range(5):
            drawn(viewer)


@pytest.mark.parametrize(
    ("view", "message"),
    [
        ({"signals": ["w"]}, "no signal 'w'"),
        ({"window": -1}, "window"),
        ({"window": float("nan")}, "window"),
        ({"columns": 10**9}, "columns"),
        ({"colums": 10}, "colums"),
        ({"trigger": {"mode": "auto", "signal": "w"}}, "no signal 'w'"),
        ({"signals": ["u"] * 99}, "signals"),
        (7, "view"),
    ],
)
def test_invalid_view_is_refused(view, message):
    with pytest.raises(UserError, match=message):
        read_view(view, ("u", "t"))
