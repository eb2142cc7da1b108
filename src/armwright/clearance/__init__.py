"""Linkages with joint clearance: simulate, estimate, correct, wear, maintain."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
