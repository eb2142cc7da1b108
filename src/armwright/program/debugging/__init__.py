"""Watching programs at work: a debugger, and the protocol by which editors speak to it."""
