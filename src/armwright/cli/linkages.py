"""What the commands for linkages with play share: options, clearances, settings of a simulation."""

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from armwright.cli.numbers import named_numbers
from armwright.cli.shell_completion import linkages, setting
from armwright.errors import InvalidValueError

if TYPE_CHECKING:
    from armwright.clearance.linkage import Linkage
    from armwright.clearance.settings import Settings

LinkageName: TypeAlias = Annotated[
    str, typer.Argument(help="Name in the catalogue, or a TOML file (docs/clearance.md).", autocompletion=linkages)
]
FrictionVelocity: TypeAlias = Annotated[
    str,
    typer.Option(
        help="Which speed slides: of the surface, or of the centre as the thesis has it.",
        autocompletion=setting("SLIP_SPEEDS"),
    ),
]
Threshold: TypeAlias = Annotated[float, typer.Option(help="Sliding speed below which friction fades.")]


def with_clearances(model: "Linkage", clearances: list[str], clearance_mm: float | None = None) -> "Linkage":
    """Return the linkage with the clearances that are asked for.

    Args:
        model: the linkage.
        clearances: of one pin each, such as ``J2=0.5`` [mm].
        clearance_mm: of all pins that are not named; those of the linkage when left out.

    Raises:
        BadParameter: a text is something else.
        InvalidValueError: a clearance is larger than the radius of its journal.
    """
    found = {} if clearance_mm is None else dict.fromkeys(model.clearances, clearance_mm * 1e-3)
    given = named_numbers(clearances, ("", "mm"), "a pin and its clearance in mm, J2=0.5", "--clearance")
    found |= {name: one.value * 1e-3 for name, one in given.items()}
    playing = model.with_clearances(found)
    for pin in playing.pins:
        c, most = playing.clearances[pin.name], pin.journal_radius
        if pin.name in found and c > most:
            raise InvalidValueError(
                f"clearance {pin.name}: expected at most the radius of the journal, {most * 1e3:g} mm, got {c * 1e3:g} "
                f"mm; if micrometres are meant, {c * 1e3:g} µm are {c:g} mm"
            )
    return playing


def settings_of(velocity: str, threshold_mm_s: float, *, law: str = "linear", **others: Any) -> "Settings":
    """Return the settings of a simulation; what stands for nothing is answered with the nearest name.

    Args:
        velocity: which speed slides.
        threshold_mm_s: sliding speed below which friction fades.
        law: of friction.
        others: settings by their names, SI.
    """
    from armwright.clearance.equations import FrictionModel
    from armwright.clearance.settings import Settings

    rubbing = FrictionModel(law=law, velocity=velocity)  # type: ignore[arg-type]
    return Settings(threshold=threshold_mm_s * 1e-3, friction=rubbing, **others)
