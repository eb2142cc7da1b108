"""Kinematics: tool poses, Jacobians, inverse kinematics with all branches, singularities."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
