"""The version of armwright."""

__version__ = "0.2.0"
