"""Experiments and designs of the thesis, repeated on the emulated machines and compared with its numbers."""
