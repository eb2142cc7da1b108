"""Estimation of the clearances of a linkage from the error of its tip: at rest, and on paths."""
