"""Identification experiments: each has a function on a record, and a config that plays its motion."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_bundles:identify")
