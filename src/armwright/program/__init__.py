"""The robot language RLO: from text over a checked tree to intermediate code, and from code to what arms do."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armwright.program.api import Compilation as Compilation
    from armwright.program.api import compile as compile  # noqa: A004 - what a translator does
    from armwright.program.language.source import Source as Source
    from armwright.program.semantics.cell_symbols import KnownCell as KnownCell
    from armwright.program.semantics.cell_symbols import known_cell as known_cell

# Loaded when they are asked for: the command line needs some words of the language for its --help, and no compiler.
_HOMES = {
    "Compilation": "api",
    "compile": "api",
    "KnownCell": "semantics.cell_symbols",
    "known_cell": "semantics.cell_symbols",
    "Source": "language.source",
}

__all__ = ["Compilation", "KnownCell", "Source", "compile", "known_cell"]


def __getattr__(name: str) -> Any:
    """Load a public name where it lives."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
