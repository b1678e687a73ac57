"""Common parts of the tick of every machine: frames, clock, shared memory, safety, and injected faults."""
