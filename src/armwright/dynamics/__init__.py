"""Dynamics: inverse and forward dynamics, mass matrix, terms of the equation of motion, energies, payloads."""

from armwright.doors import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
