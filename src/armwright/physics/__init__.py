"""The world of a cell: distances between its bodies along motions, and a world with servos, contact and grippers."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
