"""Motions and programs for real controllers, each with the proof of its own checker."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
