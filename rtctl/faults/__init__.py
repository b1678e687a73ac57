"""Every fault on every shipped machine: what detects it, after how many ticks, and what is lost."""
