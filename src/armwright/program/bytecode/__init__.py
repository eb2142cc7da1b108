"""Intermediate code: its instructions, how they are generated, and their text form."""
