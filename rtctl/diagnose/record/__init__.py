"""Recordings: columns, edges, sensors, laws of exchange format 1."""
