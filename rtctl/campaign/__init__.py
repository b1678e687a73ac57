"""Campaigns: one config run many times over a matrix of settings, on virtual time, with a table and a report of all."""
