"""Linkages from files: the catalogue by name, any other by path; the format is in docs/clearance.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from armwright.clearance.elastic_rod import MAX_MODES, Elasticity
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
# The keys of which one gives the section of an elastic body; an area also needs second_moment_mm4.
_SECTIONS = ("square_mm", "round_mm", "rectangle_mm", "tube_mm", "area_mm2")
# Dimensions of sections [mm].
_THINNEST, _THICKEST = 1e-3, 1e4
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
    below = table.table("elastic") if "elastic" in table else None
    points = _points(table)
    elastic = None if below is None else _elasticity(below, list(points))
    return Body(name=name, mass=mass, inertia=inertia, centre=centre, points=points, elastic=elastic)


def _elasticity(table: Table, points: list[str]) -> Elasticity:
    """Return what makes a body elastic; its ends are the points of a body that has two."""
    ends = table.texts("ends") if "ends" in table else points
    if len(ends) != 2:
        raise table.error("ends", f"expected the names of two points between which the body is a beam, got {len(ends)}")
    area, second_moment = _section(table)
    elastic = Elasticity(
        ends=(ends[0], ends[1]),
        area=area,
        second_moment=second_moment,
        young=table.number("young", default=Material().young, lower=1.0, upper=1e15),
        modes=table.whole("modes", 1, MAX_MODES, default=3),
        damping=table.number("damping", default=0.01, lower=0.0, upper=0.99),
    )
    table.refuse_unknown_keys()
    return elastic


def _section(table: Table) -> tuple[float, float]:
    """Return area [m²] and second moment of area [m⁴] of the section of a beam, however it is given."""
    given = [key for key in _SECTIONS if key in table]
    if len(given) != 1:
        what = " and ".join(given) or "none"
        raise table.error(None, f"expected one section, of {', '.join(_SECTIONS)}, got {what}")
    if given == ["area_mm2"]:
        area = table.number("area_mm2", lower=_THINNEST**2, upper=_THICKEST**2)
        second_moment = table.number("second_moment_mm4", lower=_THINNEST**4, upper=_THICKEST**4)
        return area * 1e-6, second_moment * 1e-12
    if given == ["square_mm"]:
        side = table.number("square_mm", lower=_THINNEST, upper=_THICKEST) * 1e-3
        return side**2, side**4 / 12
    if given == ["round_mm"]:
        across = table.number("round_mm", lower=_THINNEST, upper=_THICKEST) * 1e-3
        return math.pi / 4 * across**2, math.pi / 64 * across**4
    first, second = (float(x) for x in table.vector(given[0], 2))
    if given == ["rectangle_mm"]:
        if not _THINNEST <= min(first, second) <= max(first, second) <= _THICKEST:
            raise table.error("rectangle_mm", f"expected height in the plane and width, {_THINNEST:g} to {_THICKEST:g}")
        return first * second * 1e-6, first**3 * second / 12 * 1e-12
    if not 0 <= second <= first - _THINNEST <= _THICKEST:
        raise table.error("tube_mm", f"expected an outer diameter to {_THICKEST:g} and a smaller inner one")
    return math.pi / 4 * (first**2 - second**2) * 1e-6, math.pi / 64 * (first**4 - second**4) * 1e-12


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
