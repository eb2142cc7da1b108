"""Simulation of arms: plant with friction and stops, integrators, controllers."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
