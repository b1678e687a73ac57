"""Diagnosis of described machines: one likelihood, one search, one posterior, for any graph of bodies and joints."""
