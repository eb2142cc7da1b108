"""The measured point as an option, where it is not the tool of the arm file."""

from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from armwright.cli.numbers import numbers

if TYPE_CHECKING:
    from armwright.arm.model import Arm

MeasuredPoint: TypeAlias = Annotated[
    str | None, typer.Option("--tool-mm", help="Measured point in the frame of the last link, in mm, as in 0,0,31.")
]


def with_tool(model: "Arm", text: str | None) -> "Arm":
    """Return an arm whose tool is a point of its last link; the same arm without a text."""
    import attrs
    import numpy as np

    from armwright.spatial.poses import homogeneous

    if text is None:
        return model
    return attrs.evolve(model, tool=homogeneous(np.eye(3), np.array(numbers(text, 3, "--tool-mm")) * 1e-3))
