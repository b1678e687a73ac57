"""Soak test: a random day of a machine, played from a seed, with invariants checked on every tick."""
