"""Designs of experiments, running them on cores or a Dask cluster, and labelled results on disk."""
