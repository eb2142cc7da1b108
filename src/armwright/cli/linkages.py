"""Options, clearances and simulation settings that the commands for linkages share."""

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from typer import Argument, Option

from armwright.cli.numbers import named_numbers, numbers, within
from armwright.cli.options import usage_error
from armwright.cli.shell_completion import listed_in, paths
from armwright.errors import InvalidValueError, counted

if TYPE_CHECKING:
    from armwright.arrays import Array
    from armwright.clearance.contact import FrictionLaw
    from armwright.clearance.equations import SlipSpeed
    from armwright.clearance.linkage import Linkage
    from armwright.clearance.paths import Path as TipPath
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
# The slowest drive of a linkage with one [rev/min], and the fastest, and most of its revolutions.
_SLOWEST, _MOST = 1e-6, 1e9
# Drives of the linkages to which an option applies.
_DRIVES = {"--speed-rpm": 1, "--path": 2}
# Places of a tip and of a slide [mm], and angles of a drive [deg].
_PLACES = -1e5, 1e5

Threshold: TypeAlias = Annotated[float, Option(help="Sliding speed in mm/s below which friction is reduced towards 0.")]
TipPathName: TypeAlias = Annotated[
    str | None,
    Option(help="Path for the tip: x1 to x10, y1 to y14, or pick-and-place.", autocompletion=paths),
]
SpeedRpm: TypeAlias = Annotated[float | None, Option(help="Speed of a linkage with one drive, in rev/min.")]
Clearances: TypeAlias = Annotated[
    list[str] | None, Option(help="Radial clearance of a pin in mm, as in J2=0.5; may be repeated.")
]
ClearanceOfAll: TypeAlias = Annotated[
    float | None, Option(help="Radial clearance of all pins in mm; the default is that of the linkage.")
]
Friction: TypeAlias = Annotated[
    float | None, Option(help="Coefficient of friction; the default is that of the linkage.")
]
FrictionLawName: TypeAlias = Annotated[Literal["linear", "tanh", "lugre"], Option(help="Law of friction.")]
ContactLawName: TypeAlias = Annotated[
    str,
    Option(
        help="Contact law: lankarani-nikravesh, flores, hu-guo, carvalho-martins, exact ...",
        autocompletion=listed_in("armwright.clearance.contact", "IMPACT_LAWS"),
    ),
]
IntegratorName: TypeAlias = Annotated[Literal["rk4", "semi-implicit"], Option(help="Integrator.")]
Step: TypeAlias = Annotated[float, Option(help="Step of the integrator, in s.")]
ControlName: TypeAlias = Annotated[
    Literal["effort", "pd+ff"],
    Option(help="Control of the drives: effort (open loop) or pd+ff (feedback with feedforward)."),
]
WidthMm: TypeAlias = Annotated[float, Option(min=1e-3, max=1e4, help="Width of the bearings in mm.")]
BearingShare: TypeAlias = Annotated[float, Option(help="Part of the wear that bearings take; journals take the rest.")]


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


def poses_of(model: "Linkage", texts: list[str]) -> "Array":
    """Return the poses of options such as ``-180,-600``: those of ``armwright.clearance.closed_at``.

    Raises:
        BadParameter: a text is not the position of the tip in mm, or of the only drive in degrees or mm.
        InvalidValueError: the linkage has neither one drive nor two.
    """
    import numpy as np

    from armwright.clearance.poses import pose_size

    size = pose_size(model)
    rotates = size == 1 and model.coordinates[model.driven[0]].kind == "angle"
    poses = [[within(x, _PLACES, "--pose") for x in numbers(text, size, "--pose")] for text in texts]
    return np.array(poses) * (math.radians(1) if rotates else 1e-3)


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


def path_of(model: "Linkage", path: str | None, speed_rpm: float | None, revolutions: float) -> "TipPath":
    """Return the path of the tip, or of the drive of a linkage with a single drive."""
    from armwright.clearance.paths import constant_speed_path, named_path

    drives = len(model.drives)
    option = "--path" if path is not None else "--speed-rpm"
    if (path is None) == (speed_rpm is None):
        example = "--path y1" if drives > 1 else "--speed-rpm 300"
        raise usage_error("--path", f"expected either --path or --speed-rpm; {model.name} takes {example}")
    if drives != _DRIVES[option]:
        other = next((f"; use {name}" for name, number in _DRIVES.items() if number == drives), "")
        text = f"expected a linkage with {counted(_DRIVES[option], 'drive')}; {model.name} has {drives}{other}"
        raise usage_error(option, text)
    if path is not None:
        return named_path(path)
    assert speed_rpm is not None  # noqa: S101 - either path or speed_rpm is an argument
    if not (_SLOWEST <= abs(speed_rpm) <= _MOST and 0 < revolutions <= _MOST):
        raise usage_error(
            "--speed-rpm",
            f"expected a speed of {_SLOWEST:g} to {_MOST:g} rev/min in either direction and revolutions above 0, up to "
            f"{_MOST:g}, got {speed_rpm:g} and {revolutions:g}",
        )
    speed = speed_rpm * 2 * math.pi / 60
    start_angle = model.assembly.get(model.drives[0].body, 0.0)
    name = f"{revolutions:g} revolution{'' if revolutions == 1 else 's'} at {speed_rpm:g} rev/min"
    return constant_speed_path(name, start_angle, speed, revolutions * 2 * math.pi / abs(speed))
