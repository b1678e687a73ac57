"""Campaigns: runs of one config over a matrix of settings on virtual time, with a results table and a report."""
