"""Proof: blind test of the diagnosis on concealed cases, which are generated, sealed, diagnosed and scored.

This package shares no code with plants/, drivers/ or rtctl/diagnose: an error in their equations is not repeated here.
"""
