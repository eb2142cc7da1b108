"""Oracles that nobody here wrote, set up from our models."""
