"""How commands are declared: flags are shown without a type, and shells complete what may follow."""

from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

# Of the program, as people call it; their shell asks it by a variable of its own what may follow.
NAME = "armwright"
COMPLETE = "_ARMWRIGHT_COMPLETE"


def _without_values(parameters: list[Any]) -> list[Any]:
    """Return parameters of which flags say no type: they take no value."""
    for one in parameters:
        if getattr(one, "is_flag", False):
            one.metavar = ""
    return parameters


def _opened_later(function: Any) -> Any:
    """Let whoever reads a file find out whether it can be read: one without permission is no wrong call."""
    for annotation in function.__annotations__.values():
        for said in getattr(annotation, "__metadata__", ()):
            if hasattr(said, "readable"):
                said.readable = False
    return function


class Command(TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its arguments and options."""
        return _without_values(super().get_params(ctx))


class Group(TyperGroup):
    """A command that has commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its own options."""
        return _without_values(super().get_params(ctx))


class App(typer.Typer):
    """A collection of commands."""

    def command(self, *arguments: Any, **settings: Any) -> Callable[[Any], Any]:
        """Take a function as a command."""
        take = super().command(*arguments, **{"cls": Command, **settings})
        return lambda function: take(_opened_later(function))
