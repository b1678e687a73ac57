"""Improvement of a machine's law: from what was found to what is put against it, proved on the emulated machine."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_improve:improve")
