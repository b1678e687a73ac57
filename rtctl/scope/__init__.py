"""The scope: a page in the browser with the signals of a running machine, and commands to it where allowed."""
