"""The Python side of a running controller: supervisor, command protocol, telemetry, recorder."""
