"""Improvement and watch from a script: errors and results."""

import pytest

import rtctl


def test_argument_that_is_not_a_diagnosis_is_refused(tmp_path):
    with pytest.raises(rtctl.UserError, match="nowhere"):
        rtctl.improve(tmp_path / "nowhere")


def test_argument_that_is_not_a_recording_is_refused(tmp_path):
    with pytest.raises(rtctl.UserError, match="nowhere"):
        rtctl.watch(tmp_path / "nowhere")
