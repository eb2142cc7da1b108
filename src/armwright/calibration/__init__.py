"""Calibration: better geometry of an arm from measured positions, with what is identifiable and how well."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
