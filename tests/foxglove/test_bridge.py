"""Rows, status, events and parameters received by a viewer."""

import json

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.foxglove.bridge import Bridge
from rtctl.trace import json_rows


def test_every_row_has_the_time_of_its_tick(machine, bridged):
    bridge, viewer = bridged(rate=None)
    viewer.subscribe("/ivu")
    rows = machine.run(0.2)
    bridge.turn()
    viewer.until(lambda: len(viewer.rows.get("/ivu", [])) == len(rows))
    times, messages = zip(*viewer.rows["/ivu"], strict=True)
    for name in rows.dtype.names:
        assert [message.get(name, np.nan) for message in messages] == pytest.approx(rows[name].tolist(), nan_ok=True)
    assert np.array_equal(np.diff(times), np.diff([round(t * 1e9) for t in rows["t"].tolist()]))
    assert "/ivu/max" not in viewer.channels  # no thinning


def test_schema_is_that_of_an_exported_file(machine, bridged):
    _, viewer = bridged()
    channel = viewer.until(lambda: viewer.channels.get("/ivu"))
    assert (channel["encoding"], channel["schemaEncoding"], channel["schemaName"]) == (
        "json",
        "jsonschema",
        "rtctl.ivu",
    )
    assert json.loads(channel["schema"]) == json_rows.schema("rtctl.ivu", list(machine.made.columns))


def test_thinned_rows_come_with_their_extremes(machine, bridged):
    bridge, viewer = bridged(rate=100)
    viewer.subscribe("/ivu", "/ivu/min", "/ivu/max")
    rows = machine.run(0.2)
    bridge.turn()
    viewer.until(lambda: len(viewer.rows.get("/ivu/max", [])) == 20)
    u = rows["u1"].reshape(20, 5)
    assert [m["u1"] for _, m in viewer.rows["/ivu"]] == u[:, 4].tolist()
    assert [m["u1"] for _, m in viewer.rows["/ivu/min"]] == u.min(axis=1).tolist()
    assert [m["u1"] for _, m in viewer.rows["/ivu/max"]] == u.max(axis=1).tolist()
    assert [at for at, _ in viewer.rows["/ivu"]] == [at for at, _ in viewer.rows["/ivu/max"]]


def test_status_and_events_have_the_time_of_their_tick(machine, bridged):
    bridge, viewer = bridged()
    viewer.subscribe("/ivu/status", "/ivu/events")
    bridge.turn()
    machine.run(0.1)
    machine.bench.ask("disarm")
    rows = machine.run(0.1)
    bridge.turn()
    off = rows["tick"][np.flatnonzero(rows["state"] == 0)[0]]
    at, event = viewer.until(
        lambda: next((e for e in viewer.rows.get("/ivu/events", []) if "idle" in e[1]["message"]), None)
    )
    assert event["message"] == f"tick {off}: idle"
    assert viewer.channels["/ivu/events"]["schemaName"] == "foxglove.Log"
    assert at == event["timestamp"]["sec"] * 10**9 + event["timestamp"]["nsec"]
    assert at == bridge._channels.at(float(rows["t"][rows["tick"] == off][0]))
    status = viewer.until(lambda: viewer.rows.get("/ivu/status"))[0][1]
    assert (status["name"], status["state"], status["trip"]) == (machine.config.name, "running", None)


def test_parameters_are_the_settings(machine, bridged):
    _, viewer = bridged()
    found = viewer.parameters()
    assert found["law.position.gain"] == machine.config.law.position.gain
    assert found["safety.following_error"] == 0.5
    assert found["law.allocation.kind"] == "pull"
    assert viewer.parameters("setpoint") == {"setpoint": machine.last_row["target"]}


def test_parameters_are_read_only_without_control(machine, bridged):
    _, viewer = bridged()
    assert viewer.set(law__position__gain=25.0) == {"law.position.gain": 31.0}
    assert machine.changes == []
    status = viewer.until(lambda: viewer.said("status"))[0]
    assert (status["level"], status["message"]) == (
        1,
        "settings are shown, not changed: start `rtctl foxglove` with --control",
    )


def test_control_sets_gain_and_setpoint(machine, bridged):
    _, viewer = bridged(control=True)
    assert viewer.set(law__position__gain=25, setpoint=0.25) == {"law.position.gain": 25.0, "setpoint": 0.0}
    assert machine.changes == [("law.position.gain", 25)]
    machine.run(0.1)
    assert viewer.parameters("setpoint") == {"setpoint": 0.25}
    assert machine.last_row["ref"] > 0


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("law.position.tau_d", -1.0, "law.position.tau_d: -1.0 s is out of bounds: it must be at least 0 s"),
        ("law.position.gian", 1.0, "law.position.gian: unknown key; did you mean 'gain'?"),
        ("law.position.gain", "high", "law.position.gain"),
        ("loop.rate", 1000.0, "cannot change while the machine runs"),
        ("setpoint", "far", "setpoint"),
    ],
)
def test_invalid_parameter_is_refused_with_the_message_of_the_daemon(machine, bridged, name, value, why):
    _, viewer = bridged(control=True)
    before = viewer.parameters(name)
    assert viewer.set(**{name.replace(".", "__"): value}) == before
    status = viewer.until(lambda: viewer.said("status"))[0]
    assert status["level"] == 2
    assert why in status["message"]
    assert machine.changes == []


def test_parameter_changes_of_other_clients_are_sent_to_viewers(machine, bridged):
    bridge, viewer = bridged()
    viewer.subscribe("/ivu/events")
    viewer._send("subscribeParameterUpdates", parameterNames=["law.position.gain"])
    viewer.parameters()
    with Client(machine.endpoint) as client:
        client.call("set", path="law.position.gain", value=29.0)
    bridge.turn()
    update = viewer.until(lambda: next((m for m in viewer.said("parameterValues") if "id" not in m), None))
    assert [(p["name"], p["value"]) for p in update["parameters"]] == [("law.position.gain", 29.0)]
    viewer.until(lambda: any("gain is 29.0" in e["message"] for _, e in viewer.rows.get("/ivu/events", [])))


def test_bridge_reconnects_to_a_restarted_daemon(machine, bridged):
    bridge, viewer = bridged()
    machine.stop()
    bridge._client.timeout = 0.1
    bridge._next_status = 0.0
    bridge.turn()
    assert bridge.gone
    viewer.until(lambda: any("has ended" in m["message"] for m in viewer.said("status")))
    bridge.turn()
    assert bridge.gone
    machine.start()
    viewer.channels.clear()
    bridge.turn()
    assert not bridge.gone
    viewer.until(lambda: viewer.said("removeStatus"))
    viewer.until(lambda: "/ivu" in viewer.channels)
    viewer.subscribe("/ivu")
    machine.run(0.01)
    bridge.turn()
    viewer.until(lambda: len(viewer.rows.get("/ivu", [])) == 5)


def test_two_viewers_are_served(machine, bridged):
    bridge, first = bridged()
    second = type(first)(bridge.url)
    for viewer in (first, second):
        viewer.subscribe("/ivu")
    machine.run(0.1)
    bridge.turn()
    for viewer in (first, second):
        viewer.until(lambda viewer=viewer: len(viewer.rows.get("/ivu", [])) == 50)
    second.close()


def test_overwritten_rows_are_reported(machine, bridged):
    bridge, viewer = bridged()
    viewer.subscribe("/ivu", "/ivu/events")
    for _ in range(5):
        machine.run(10.0)
    bridge.turn()
    lost = viewer.until(
        lambda: [e["message"] for _, e in viewer.rows.get("/ivu/events", []) if "overwritten" in e["message"]]
    )
    assert int(lost[0].split()[0]) >= 5000


def test_port_in_use_is_an_error(machine, bridged):
    bridge, _ = bridged()
    with pytest.raises(UserError, match="choose another --port"):
        Bridge(Client(machine.endpoint), "127.0.0.1", bridge._server.port, None, False)
