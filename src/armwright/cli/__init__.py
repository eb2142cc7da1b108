"""The command line: one module per command; the only place with degrees and millimetres."""
