"""How much play a linkage has, told from the error of its tip: at rest, and on paths."""
