"""The experiments and designs of the thesis done again on the emulated machines, its numbers beside ours."""
