"""Diagnostics for people and tools: rendered, as SARIF, and with a page and tested programs for every code."""
