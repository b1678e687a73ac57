"""The reference pages of the manual and the man page, made of the settings and of the command line themselves."""
