"""The workbench in a browser: arms moved by hand, frames taught, programs written and run, on one page."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
