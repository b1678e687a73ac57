"""The report is a valid request of the command socket, with lanes of the newest windows."""

import numpy as np

from rtctl.daemon.protocol import decode_request, encode_request
from rtctl.watch.monitor import Monitor
from rtctl.watch.report import LANE_SECONDS, report


def test_report_of_a_waiting_and_of_a_watching_monitor(rehearsed):
    monitor = Monitor(rehearsed.case, band=rehearsed.band)
    waits = report(monitor, [], None)
    assert waits == {"state": "waiting", "learned": 1.0}
    monitor.feed(rehearsed.after)
    told = report(monitor, ["a", "b"], {"t": 1.0, "words": "x"})
    asked = decode_request(encode_request(1, "watch", told)).args
    assert asked.state == "watching"
    assert asked.notes == ["a", "b"]
    assert set(asked.lanes) == {"missing_capstan", "residual_encoder"}
    assert asked.lanes["missing_capstan"].unit == "Nm"
    assert 0.3 < asked.residual["encoder"] < 3.0
    t = np.array(asked.t)
    assert t[-1] - t[0] < LANE_SECONDS + 0.2
    assert (np.diff(t) > 0).all()
    assert all(len(lane.values) == len(t) for lane in asked.lanes.values())
