"""Condition monitoring of a running machine by its model: residuals, missing force, and an alarm on a departure."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_improve:watch")
