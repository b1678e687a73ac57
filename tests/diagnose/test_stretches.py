"""Loudness of stretches, and what is usual."""
