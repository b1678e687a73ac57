"""What others would do with the same recordings: simple ways to find missing physics, in the same exchange form."""
