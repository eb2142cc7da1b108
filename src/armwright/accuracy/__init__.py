"""Pose and path characteristics of ISO 9283, from measured positions."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
