"""Parameters of a machine over many recordings: fitted one by one, tested for changes."""
