"""Experiments: what the data of a run say of the machine. Each is a function of a record and a config that plays it."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_bundles:identify")
