"""Foxglove parameters of a running machine: settings such as `law.position.gain`, in SI, and `setpoint`.

The daemon checks each new value. Its error message goes to all connected viewers, and the panel shows the old value
again.
"""

import threading
from typing import Any

import foxglove
from foxglove.websocket import Client as Viewer
from foxglove.websocket import ServerListener

from rtctl.config.errors import UserError
from rtctl.daemon.client import CommandError

SECTIONS = ("law", "radius", "safety")  # sections of the config that can change while a machine runs
SETPOINT = "setpoint"
READ_ONLY = "settings are shown, not changed: start `rtctl foxglove` with --control"


class Parameters(ServerListener):
    """Listener of the Foxglove server, called from its threads. A lock serialises the use of its own `client`."""

    def __init__(self, client: Any, control: bool):
        self.server: Any = None  # set once the server has started
        self._client, self._control = client, control
        self._lock = threading.Lock()

    def close(self) -> None:
        with self._lock:
            self._client.close()

    def values(self) -> dict[str, Any]:
        """Settings with a value, by path, and the setpoint. Raises UserError where no daemon answers."""
        with self._lock:
            return self._values()

    def on_get_parameters(
        self, client: Viewer, param_names: list[str], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Parameters by name; all of them where no names are given."""
        try:
            found = self.values()
        except UserError as error:
            self._tell(foxglove.StatusLevel.Error, str(error), "get")
            return []
        return [foxglove.Parameter(name, value=found[name]) for name in param_names or found if name in found]

    def on_set_parameters(
        self, client: Viewer, parameters: list[foxglove.Parameter], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Set the parameters; returns the values in force, so that the panel resets a refused one."""
        for parameter in parameters:
            self._set(parameter.name, parameter.get_value())
        return self.on_get_parameters(client, [parameter.name for parameter in parameters])

    def _set(self, name: str, value: Any) -> None:
        if not self._control:
            self._tell(foxglove.StatusLevel.Warning, READ_ONLY, "control")
            return
        try:
            with self._lock:
                if name == SETPOINT:
                    self._client.call("setpoint", value=value)
                elif value is not None:  # None: removal of a parameter is ignored
                    self._client.call("set", path=name, value=value)
        except UserError as error:
            self._tell(foxglove.StatusLevel.Error, str(error), f"set {name}")
        else:
            self.server.remove_status([f"set {name}"])

    def _values(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        top = self._client.call("status")["signals"]
        if "target" in top:
            found[SETPOINT] = top["target"]
        for section in SECTIONS:
            try:
                value = self._client.call("get", path=section)["value"]
            except CommandError as error:
                if error.code != "refused":
                    raise
                continue  # this machine has no such section
            _flatten(section, value, found)
        return found

    def _tell(self, level: Any, message: str, id: str) -> None:
        if self.server is not None:
            self.server.publish_status(message, level, id)


def _flatten(path: str, value: Any, into: dict[str, Any]) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            _flatten(f"{path}.{key}", item, into)
    elif isinstance(value, (bool, int, float, str)) or _is_row(value):
        into[path] = value


def _is_row(value: Any) -> bool:
    """Whether a value is a list of floats: no other list can be a parameter."""
    return isinstance(value, list) and bool(value) and all(type(item) is float for item in value)
