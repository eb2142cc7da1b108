"""Reproducible experiments of the sources: inputs, run, published numbers beside computed ones."""
