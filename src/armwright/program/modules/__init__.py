"""Modules: the files of a program, what names each sees of the others, and the one program that they make."""
