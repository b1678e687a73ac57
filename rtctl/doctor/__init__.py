"""What this machine can promise for a loop at a fixed rate: what its kernel says, and what a measurement says."""
