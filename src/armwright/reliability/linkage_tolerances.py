"""Files of tolerances of a linkage: clearances with their means, lengths, zeros of drives, and other dimensions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from armwright.clearance.dimensions import Dimension, DimensionKind, dimensions_of
from armwright.clearance.linkage import Linkage
from armwright.errors import InvalidValueError
from armwright.files.document import Document, Table
from armwright.reliability.tolerances import SHOWN, Tolerance, Unit, read_costs, read_half_width

# Stands for all dimensions of a table that are not named in it.
_ALL = "all"
_SI = {unit: scale for scale, unit in SHOWN.values()}


class _Kind(NamedTuple):
    """A table of a file: which dimensions it has, in which unit."""

    table: str
    kind: DimensionKind
    unit: Unit


_CLEARANCES = _Kind("clearances_mm", "clearance", "m")
_KINDS = (
    _Kind("lengths_mm", "length", "m"),
    _Kind("angles_deg", "zero", "rad"),
    _Kind("slides_mm", "zero", "m"),
    _Kind("tool_mm", "tool", "m"),
    _Kind("points_mm", "point", "m"),
    _Kind("guides_deg", "guide", "rad"),
    _Kind("masses_kg", "mass", "kg"),
    _Kind("loads_N", "load", "N"),
)


class LinkageTolerances(NamedTuple):
    """What a file says of a linkage.

    Attributes:
        linkage: with the mean clearances of the file.
        tolerances: above zero, in the order of its dimensions.
    """

    linkage: Linkage
    tolerances: tuple[Tolerance, ...]


def read_linkage_tolerances(path: Path | str, linkage: Linkage) -> LinkageTolerances:
    """Read a file of tolerances of a linkage (docs/clearance.md).

    Args:
        path: a TOML file.
        linkage: whose dimensions they are. Its own clearances do not count: the file has their means.

    Raises:
        FileFormatError: the file is missing or malformed, names something that the linkage has not, or lacks the
            clearance of a pin.
        InvalidValueError: no tolerance is above zero.
    """
    root = Document.read(Path(path)).root
    every = dimensions_of(linkage)
    means, values = _read_clearances(root.table(_CLEARANCES.table, required=bool(linkage.pins)), linkage)
    mean = linkage.with_clearances(means)
    for kind in _KINDS:
        values |= _read_kind(root.table(kind.table), kind, every)
    exponent, factors = read_costs(root.table("cost"), linkage.name, {dimension.name for dimension in every})
    root.refuse_unknown_keys()
    masses = {f"{body.name}.mass": body.mass for body in linkage.bodies}
    most = {f"{name}.clearance": value for name, value in means.items()} | masses
    found = tuple(
        Tolerance(
            name=name,
            half_width=values[name],
            unit=unit,
            cost=factors.get(name, 1.0),
            exponent=exponent,
            most=most.get(name, math.inf),
        )
        for name, _, unit in every
        if values.get(name, 0.0) > 0
    )
    for tolerance in found:
        if tolerance.half_width > tolerance.most:
            raise InvalidValueError(
                f"{path}: tolerance of {tolerance.name}: expected at most its mean, {tolerance.most:g} "
                f"{tolerance.unit}, got {tolerance.half_width:g}"
            )
    if not found:
        raise InvalidValueError(f"{path}: expected a tolerance above zero, such as all = 0.05 in [lengths_mm]")
    return LinkageTolerances(mean, found)


def _read_clearances(table: Table, linkage: Linkage) -> tuple[dict[str, float], dict[str, float]]:
    """Return the mean clearance of each pin, and the tolerance of each dimension ``PIN.clearance`` [m]."""
    means: dict[str, float] = {}
    widths: dict[str, float] = {}
    table.allow(_ALL, *(pin.name for pin in linkage.pins))
    for pin in linkage.pins:
        key = pin.name if pin.name in table or _ALL not in table else _ALL
        mean, width = (float(x) for x in table.vector(key, 2))
        most = pin.journal_radius * 1e3
        if not 0 <= mean <= most:
            raise table.error(
                key, f"expected a mean clearance of 0 to the radius of the journal, {most:g} mm, got {mean:g}"
            )
        if not 0 <= width <= mean:
            raise table.error(key, f"expected a tolerance of 0 to the mean clearance, {mean:g} mm, got {width:g}")
        means[pin.name], widths[f"{pin.name}.clearance"] = mean * 1e-3, width * 1e-3
    table.refuse_unknown_keys()
    return means, widths


def _read_kind(table: Table, kind: _Kind, every: tuple[Dimension, ...]) -> dict[str, float]:
    """Return the tolerances of a table by the names of dimensions [m, rad, kg, N]."""
    unit = kind.table.rpartition("_")[2]
    values: dict[str, float] = {}
    default = read_half_width(table, _ALL, unit)
    for name in (each.name for each in every if (each.kind, each.unit) == (kind.kind, kind.unit)):
        key = _short(name, kind.kind)
        values[name] = read_half_width(table, key, unit, default) * _SI[unit]
    table.refuse_unknown_keys()
    return values


def _short(name: str, kind: DimensionKind) -> str:
    """Return the name of a dimension in the table of its kind: ``link2`` for ``link2.length``."""
    if kind in {"length", "zero", "mass"}:
        return name.removesuffix(f".{kind}")
    return name.removeprefix("tool.") if kind == "tool" else name
