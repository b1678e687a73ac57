"""What every tick has, whatever the machine: frames, clock, shared memory, safety, and faults of link and board."""
