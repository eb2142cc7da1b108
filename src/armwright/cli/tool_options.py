"""Options about the tool: its payload, and the measured point where it is not the tool of the arm file."""

from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer
from typer import Option

from armwright.cli.numbers import numbers
from armwright.cli.options import usage_error

if TYPE_CHECKING:
    from armwright.arm.model import Arm, Link

Load: TypeAlias = Annotated[
    str | None,
    Option("--load", help="Payload in the tool frame: MASS,X,Y,Z in kg and mm, or a TOML file with its inertia."),
]
MeasuredPoint: TypeAlias = Annotated[
    str | None, Option("--tool-mm", help="Measured point in the frame of the last link, in mm, as in 0,0,31.")
]


def read_payload(text: str) -> "Link":
    """Return the body that the gripper holds.

    Raises:
        BadParameter: the text is neither a file nor a mass, 0 or more, with a position.
        FileFormatError: the file is missing or invalid.
    """
    from armwright.arm.load import is_path, read_load
    from armwright.arm.model import Link

    if is_path(text):
        return read_load(text)
    try:
        mass, *position = numbers(text, 4, "--load")
    except typer.BadParameter as error:
        raise usage_error("--load", f"{error.message}, or a file that ends in .toml") from error
    if mass < 0:
        raise usage_error("--load", f"expected a mass of 0 kg or more, got {mass:g}")
    return Link(mass=mass, com=[x * 1e-3 for x in position])


def with_tool(model: "Arm", text: str | None) -> "Arm":
    """Return an arm whose tool is a point of its last link; the same arm without a text."""
    import attrs
    import numpy as np

    from armwright.spatial.poses import homogeneous

    if text is None:
        return model
    return attrs.evolve(model, tool=homogeneous(np.eye(3), np.array(numbers(text, 3, "--tool-mm")) * 1e-3))
