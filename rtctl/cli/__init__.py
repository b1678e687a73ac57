"""One file a command. A command parses, calls one function elsewhere and prints; nothing else lives here."""
