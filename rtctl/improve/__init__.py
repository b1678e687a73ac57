"""Improvement of a machine's law: from what was found to what is put against it, proved on the emulated machine."""
