"""Finds the physics that a simulation lacks: from a recording and the owner's model to names, nodes and sizes."""
