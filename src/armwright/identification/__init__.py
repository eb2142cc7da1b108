"""Identification: better dynamics of an arm from measured efforts, with what is identifiable and how well."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
