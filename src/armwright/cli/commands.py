"""Classes of Typer adapted: flags are shown without a type, and files are checked when they are read."""

from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

# Name of the program, and the environment variable by which a shell asks for completions.
NAME = "armwright"
COMPLETE = "_ARMWRIGHT_COMPLETE"


def _without_values(parameters: list[Any]) -> list[Any]:
    """Return the parameters, with the name of a value removed from flags, which take none."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


def _without_permission_checks(function: Any) -> Any:
    """Return a command whose file arguments are not tested for permission: that is no error of usage."""
    for annotation in function.__annotations__.values():
        for declaration in getattr(annotation, "__metadata__", ()):
            if hasattr(declaration, "readable"):
                declaration.readable = False
    return function


class Command(TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its arguments and options."""
        return _without_values(super().get_params(ctx))


class Group(TyperGroup):
    """A group of commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its own options."""
        return _without_values(super().get_params(ctx))


class App(typer.Typer):
    """An application or a group of commands."""

    def command(self, *arguments: Any, **settings: Any) -> Callable[[Any], Any]:
        """Return a decorator that registers a function as a command."""
        register = super().command(*arguments, **{"cls": Command, **settings})
        return lambda function: register(_without_permission_checks(function))
