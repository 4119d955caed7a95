"""A file for each command: its name is that of the file, and `run` declares group, help, options and what it does.

A file is loaded when its command is called or listed, so it imports libraries where they are used.
"""
