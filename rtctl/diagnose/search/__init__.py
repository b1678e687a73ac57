"""Hypotheses, and combinations of them by evidence."""
