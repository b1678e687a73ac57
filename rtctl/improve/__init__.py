"""Improvement of a machine's law: remedies against the effects of a diagnosis, proved on the emulated machine."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_improve:improve")
