"""Tolerances, probabilities of error and life of arms and linkages: bounds, laws, least cost, wear, measurements."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
