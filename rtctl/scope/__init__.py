"""The scope: rows of a running machine to a page in the browser, and commands back where that is allowed."""
