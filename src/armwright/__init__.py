"""A workbench for robot manipulators."""

__version__ = "0.1.0"
