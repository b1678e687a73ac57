"""What a person at a terminal sees of a running machine: panel, sparklines, plain lines where there is no terminal."""
