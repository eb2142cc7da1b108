"""Names, kinds and values: what the words of a program stand for, and whether they fit."""
