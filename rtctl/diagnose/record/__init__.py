"""Recordings as files hold them: columns, edges, sensors, laws of exchange format 1."""
