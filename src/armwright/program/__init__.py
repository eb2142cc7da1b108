"""The robot language RLO: compile programs and run them in a cell."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
