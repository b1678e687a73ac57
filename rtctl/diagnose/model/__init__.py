"""Nominal model of a machine, and its simulation under a recording: kernel, observer, closed loop, unknowns."""
