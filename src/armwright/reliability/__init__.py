"""Tolerances and the accuracy that follows from them: bounds, probabilities, least cost."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
