"""Reproducible experiments of the sources: inputs, run, published numbers beside computed ones."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
