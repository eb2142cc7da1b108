"""Intermediate code: what a program becomes, how it is made, and its text form."""
