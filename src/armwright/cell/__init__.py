"""Robot cells: frame tree, arms, devices, camera; cell files; the kinematic simulator."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
