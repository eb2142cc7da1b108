"""A page for every message, with programs that are tried."""
