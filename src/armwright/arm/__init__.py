"""The model of an arm: joints, links, motors, limits; arm files, URDF, and the catalogue."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
