"""Improvement and watch from a script: what they raise, and what they return."""

import pytest

import rtctl


def test_what_is_no_diagnosis_is_refused(tmp_path):
    with pytest.raises(rtctl.UserError, match="nowhere"):
        rtctl.improve(tmp_path / "nowhere")


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(rtctl.UserError, match="nowhere"):
        rtctl.watch(tmp_path / "nowhere")
