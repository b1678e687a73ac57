"""What a description says: in words, as a drawing, with its modes, and what its sensors can tell apart."""
