"""Noise, errors of laws, likelihood of a recording, and fit of a model."""
