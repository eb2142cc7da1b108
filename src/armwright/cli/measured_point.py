"""The point of the hand that is measured, where it is not the tool of the arm file."""

from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from armwright.cli.numbers import numbers

if TYPE_CHECKING:
    from armwright.arm.model import Arm

MeasuredPoint: TypeAlias = Annotated[
    str | None, typer.Option("--tool-mm", help="The measured point in the frame of the hand: 0,0,31.")
]


def with_tool(model: "Arm", text: str | None) -> "Arm":
    """Return an arm whose tool is a point of its hand; the same arm where none is told."""
    import attrs
    import numpy as np

    from armwright.spatial.poses import homogeneous

    if text is None:
        return model
    return attrs.evolve(model, tool=homogeneous(np.eye(3), np.array(numbers(text, 3, "--tool-mm")) * 1e-3))
