"""Semantic analysis: symbols, scopes and types, one module for each family of statements."""
