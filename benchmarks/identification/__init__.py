"""Ways of others to fit a machine to a recording, each on the same rows: see benchmarks/identification_peers.py."""
