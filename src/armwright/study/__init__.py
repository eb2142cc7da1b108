"""Experiments of the seeds, each reproducible: inputs, run, printed beside computed."""
