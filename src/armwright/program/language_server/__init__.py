"""The language server: what an editor asks about a program, in the Language Server Protocol."""
