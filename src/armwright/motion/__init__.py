"""Motions: profiles, splines, straight lines with certificates, moves, time-optimal paths."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
