"""The text of a program: characters, places in them, line numbers, words, tokens, colours."""
