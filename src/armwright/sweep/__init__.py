"""Designs of experiments, running them on cores or a Dask cluster, and labelled results on disk."""

from armwright.lazy_namespace import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
