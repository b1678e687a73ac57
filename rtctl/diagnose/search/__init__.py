"""Search over hypotheses and their combinations by evidence."""
