"""The robot language RLO: from text over a checked tree to intermediate code."""

from armwright.program.compiler import Compilation, compile  # noqa: A004 - what a translator does is compile
from armwright.program.known import KnownCell, known_cell
from armwright.program.source import Source

__all__ = ["Compilation", "KnownCell", "Source", "compile", "known_cell"]
