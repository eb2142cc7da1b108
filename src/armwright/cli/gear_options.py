"""Options of the gears of an arm, which commands of vibration and deflection share."""

from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.numbers import numbers, within
from armwright.cli.options import usage_error

if TYPE_CHECKING:
    from armwright.arm.model import Arm

Stiffness = Annotated[
    str | None,
    Option(help="Stiffness of the gears in N m/rad and N/m, one for all or one per joint; inf is rigid."),
]
Damping = Annotated[
    str | None, Option(help="Damping of the gears in N m s/rad and N s/m, one for all or one per joint.")
]


def with_gears_of(arm: "Arm", stiffness: str | None, damping: str | None) -> "Arm":
    """Return an arm with the gears that options describe; of those that are left out, with its own."""
    from armwright.dynamics.flexible_joints import with_gears

    if stiffness is None and damping is None:
        return arm
    values = []
    for name, text in (("stiffness", stiffness), ("damping", damping)):
        values.append(arm.motor_values(name).tolist() if text is None else gear_values(text, arm.n, f"--{name}"))
    return with_gears(arm, *values)


def gear_values(text: str, n: int, option: str) -> list[float]:
    """Read one number for all gears, or one for each; ``inf`` is a rigid gear."""
    from armwright.arm.drive import STIFFNESS

    words = text.replace(",", " ").split()
    if len(words) not in (1, n):
        raise usage_error(option, f"expected one number, or {n}, one per joint, got {len(words)}")
    bounds = STIFFNESS if option == "--stiffness" else (0.0, STIFFNESS[1])
    values = [
        float("inf")
        if word == "inf" and option == "--stiffness"
        else within(numbers(word, 1, option)[0], bounds, option)
        for word in words
    ]
    return values * (n if len(values) == 1 else 1)
