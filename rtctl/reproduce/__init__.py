"""Reproduction of the experiments and designs of the thesis on the emulated machines, with a comparison of numbers."""
