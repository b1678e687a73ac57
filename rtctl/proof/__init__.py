"""The proof: concealed cases made by equations of their own, sealed, diagnosed, scored.

Nothing here shares code with plants/, drivers/ or rtctl/diagnose: what is wrong there must not be wrong here alike.
"""
