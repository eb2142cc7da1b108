"""The formatter: a program is laid out from its words, its comments kept."""
