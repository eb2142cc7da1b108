"""Dynamics: inverse and forward dynamics, mass matrix, terms of the equation of motion, energies, payloads."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
