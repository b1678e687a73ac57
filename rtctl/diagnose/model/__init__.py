"""A machine as somebody believes it, and its simulation under a recording: kernel, observer, closed loop, unknowns."""
