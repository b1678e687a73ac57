"""Baseline methods that find missing physics in a recording, with the output format of `rtctl diagnose`."""
