"""Linkages from files: the catalogue by name, any other by path; the format is in docs/clearance.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from armwright.clearance.linkage import (
    GRAVITY,
    GROUND,
    Body,
    BodyPoint,
    ClearancePin,
    Drive,
    Guide,
    Linkage,
    Load,
    Material,
    Pin,
)
from armwright.errors import ArmwrightError, UnknownNameError
from armwright.files.document import Document, Table
from armwright.files.inputs import file_path

_Part = TypeVar("_Part")
_CATALOGUE = Path(__file__).parent / "catalogue"


def linkage_names() -> list[str]:
    """Return the names of the catalogue, sorted."""
    return sorted(path.stem for path in _CATALOGUE.glob("*.toml"))


def load_linkage(source: str | Path) -> Linkage:
    """Return a linkage by its name in the catalogue, or from a TOML file.

    Args:
        source: a name such as ``five-bar``, or a path.

    Raises:
        UnknownNameError: the catalogue has no such linkage; the nearest is named.
        FileFormatError: the file is missing, broken or inconsistent; the text has file, line and key.
    """
    text = str(source)
    if isinstance(source, str) and not ("/" in text or "." in text or Path(text).is_file()):
        if text not in linkage_names():
            raise UnknownNameError("linkage", text, linkage_names())
        return read_linkage(_CATALOGUE / f"{text}.toml")
    return read_linkage(file_path(source))


def read_linkage(path: Path) -> Linkage:
    """Read a linkage from a TOML file.

    Raises:
        FileFormatError: it is missing, broken or inconsistent.
    """
    top = Document.read(path).root
    fields: dict[str, Any] = {
        "ground": Body(name=GROUND, points=_points(top.table("ground", required=True))),
        "bodies": _read_each(top, "body", _body),
        "joints": _read_each(top, "joint", _joint),
        "pins": _read_each(top, "play", _clearance_pin),
        "drives": _read_each(top, "drive", _drive),
        "loads": _read_each(top, "load", _load) if "load" in top else (),
        "material": _material(top.table("material")),
        "name": top.text("name", default=path.stem),
        "zero": math.radians(top.number("zero_deg", default=0.0)),
        "assembly": _assembly(top.table("assembly")),
        "gravity": top.vector("gravity", 2, default=GRAVITY),
        "tip": _body_point(top, "tip"),
    }
    top.refuse_unknown_keys()
    try:
        return Linkage(**fields)
    except ArmwrightError as error:
        raise top.error(None, str(error)) from error


def _read_each(top: Table, key: str, read: Callable[[Table], _Part]) -> list[_Part]:
    """Read the tables of a kind, each of which holds the keys that are read and no others."""
    parts = []
    for table in top.tables(key, "bodies"):
        parts.append(read(table))
        table.refuse_unknown_keys()
    return parts


def _body_point(table: Table, key: str) -> BodyPoint:
    text = table.text(key)
    body, colon, point = text.partition(":")
    if not (body and colon and point):
        raise table.error(key, f"expected a point of a body such as 'link1:J2', got {text!r}")
    return BodyPoint(body, point)


def _points(table: Table) -> dict[str, list[float]]:
    points = table.table("points")
    positions = {key: [float(x) for x in points.vector(key, 2)] for key in points}
    table.refuse_unknown_keys()
    return positions


def _body(table: Table) -> Body:
    name, mass = table.text("name"), table.positive("mass")
    inertia = table.number("inertia", default=0.0, lower=0.0)
    centre = table.vector("centre", 2, default=(0.0, 0.0))
    return Body(name=name, mass=mass, inertia=inertia, centre=centre, points=_points(table))


def _joint(table: Table) -> Pin | Guide:
    kind = table.choice("kind", ("pin", "guide"))
    body, point, on = table.text("body"), table.text("point"), _body_point(table, "on")
    if kind == "pin":
        return Pin(body=body, point=point, on=on)
    direction, angle = (math.radians(table.number(key, default=0.0)) for key in ("direction_deg", "angle_deg"))
    return Guide(body=body, point=point, on=on, direction=direction, angle=angle)


def _clearance_pin(table: Table) -> ClearancePin:
    name, bearing, journal = table.text("name"), _body_point(table, "bearing"), _body_point(table, "journal")
    clearance = table.number("clearance_mm", lower=0.0) * 1e-3
    radius = table.positive("journal_radius_mm") * 1e-3
    return ClearancePin(name=name, bearing=bearing, journal=journal, clearance=clearance, journal_radius=radius)


def _drive(table: Table) -> Drive:
    body, kind = table.text("body"), table.choice("kind", ("effort", "motion"), default="effort")
    return Drive(body=body, kind="motion" if kind == "motion" else "effort")


def _load(table: Table) -> Load:
    return Load(point=_body_point(table, "at"), force=table.vector("force", 2))


def _assembly(table: Table) -> dict[str, float]:
    """Return approximate coordinates by body: an angle as ``link1_deg = -70``, a slide as ``slider_mm = 170``."""
    values = {}
    for key in table:
        body, _, unit = key.rpartition("_")
        if not body or unit not in ("deg", "mm"):
            raise table.error(key, "expected the name of a body with its unit, such as link1_deg or slider_mm")
        values[body] = math.radians(table.number(key)) if unit == "deg" else table.number(key) * 1e-3
    table.refuse_unknown_keys()
    return values


def _material(table: Table) -> Material:
    usual = Material()
    material = Material(
        young=table.number("young", default=usual.young, lower=1.0),
        poisson=table.number("poisson", default=usual.poisson, lower=-0.99, upper=0.5),
        restitution=table.number("restitution", default=usual.restitution, lower=1e-3, upper=1.0),
        friction=table.number("friction", default=usual.friction, lower=0.0),
    )
    table.refuse_unknown_keys()
    return material
