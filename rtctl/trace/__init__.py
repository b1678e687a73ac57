"""Bundles (recording.parquet and case.json), their repair, metrics and plots."""
