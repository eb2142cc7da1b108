"""The payload as an option: a point mass in kilograms and millimetres, or a file with its inertia."""

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from armwright.arm.model import Link

Load = Annotated[
    str | None,
    typer.Option("--load", help="Payload in the tool frame: MASS,X,Y,Z in kg and mm, or a TOML file with its inertia."),
]


def read_payload(text: str) -> "Link":
    """Return the body that the gripper holds.

    Raises:
        BadParameter: the text is neither a file nor a mass, 0 or more, with a position.
        FileFormatError: the file is missing or invalid.
    """
    from armwright.arm.load import is_path, read_load
    from armwright.arm.model import Link
    from armwright.cli.numbers import numbers

    if is_path(text):
        return read_load(text)
    try:
        mass, *position = numbers(text, 4, "--load")
    except typer.BadParameter as error:
        raise typer.BadParameter(f"{error.message}, or a file that ends in .toml", param_hint="--load") from error
    if mass < 0:
        raise typer.BadParameter(f"expected a mass of 0 kg or more, got {mass:g}", param_hint="--load")
    return Link(mass=mass, com=[x * 1e-3 for x in position])
