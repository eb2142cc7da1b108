"""Kernels of one arm, compiled: the same equations for one configuration or for millions."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
