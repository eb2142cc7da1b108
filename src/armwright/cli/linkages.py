"""Options, clearances and simulation settings that the commands for linkages share."""

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from typer import Argument, Option

from armwright.cli.numbers import named_numbers
from armwright.cli.shell_completion import listed_in
from armwright.errors import InvalidValueError

if TYPE_CHECKING:
    from armwright.clearance.contact import FrictionLaw
    from armwright.clearance.equations import SlipSpeed
    from armwright.clearance.linkage import Linkage
    from armwright.clearance.settings import Settings

LinkageName: TypeAlias = Annotated[
    str,
    Argument(
        help="Name in the catalogue, or path of a TOML file (docs/clearance.md).",
        autocompletion=listed_in("armwright.clearance.reader", "linkage_names", or_file=True),
    ),
]
FrictionVelocity: TypeAlias = Annotated[
    Literal["surface", "centre"],
    Option(help="Sliding velocity: of the surface, or of the journal's centre as in the thesis."),
]
Threshold: TypeAlias = Annotated[float, Option(help="Sliding speed in mm/s below which friction is reduced towards 0.")]


def with_clearances(model: "Linkage", clearances: list[str], clearance_mm: float | None = None) -> "Linkage":
    """Return a linkage with other clearances.

    Args:
        model: the linkage.
        clearances: of a pin each, such as ``J2=0.5`` [mm].
        clearance_mm: of all other pins; the default is that of the linkage.

    Raises:
        BadParameter: a text is not a pin with its clearance.
        InvalidValueError: a clearance is larger than the radius of its journal.
    """
    requested = {} if clearance_mm is None else dict.fromkeys(model.clearances, clearance_mm * 1e-3)
    named = named_numbers(clearances, ("", "mm"), "a pin and its clearance in mm, J2=0.5", "--clearance")
    requested |= {name: number.value * 1e-3 for name, number in named.items()}
    linkage = model.with_clearances(requested)
    for pin in linkage.pins:
        c, most = linkage.clearances[pin.name], pin.journal_radius
        if pin.name in requested and c > most:
            raise InvalidValueError(
                f"clearance {pin.name}: expected at most the radius of the journal, {most * 1e3:g} mm, got {c * 1e3:g} "
                f"mm; if micrometres are meant, {c * 1e3:g} µm are {c:g} mm"
            )
    return linkage


def settings_of(
    velocity: "SlipSpeed", threshold_mm_s: float, *, law: "FrictionLaw" = "linear", **others: Any
) -> "Settings":
    """Return the settings of a simulation.

    Args:
        velocity: name of the sliding velocity.
        threshold_mm_s: sliding speed below which friction fades.
        law: name of the law of friction.
        others: further settings by name, in SI units.

    Raises:
        UnknownNameError: a name is unknown; the message has the nearest valid name.
    """
    from armwright.clearance.equations import FrictionModel
    from armwright.clearance.settings import Settings

    friction = FrictionModel(law=law, velocity=velocity)
    return Settings(threshold=threshold_mm_s * 1e-3, friction=friction, **others)
