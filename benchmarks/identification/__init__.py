"""Other identification methods, each on equal rows of a recording: see benchmarks/identification_peers.py."""
