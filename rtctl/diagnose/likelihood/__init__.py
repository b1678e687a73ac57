"""Noise, errors of laws, the likelihood of a recording, and the fit of a model by it."""
