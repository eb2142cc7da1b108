"""The files of a life of a wearing linkage: a page, its numbers, profiles and curves."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.clearance.wear.assessment import QUANTILES, WearAssessment
from armwright.clearance.wear.foundation import bin_angles
from armwright.clearance.wear.life_file import surfaces_data
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, plain_label, round_number, svg_text
from armwright.report.motion_table import csv_lines
from armwright.report.static_page import static_page

# The deepest wear is drawn as this part of the radius of its circle.
_DEPTH_SHARE = 0.35
# Points along a band of a curve, and wear coefficients across it.
_BAND = 60


def wear_files(assessment: WearAssessment, *, command: str) -> dict[str, Any]:
    """Return the files of a life by name.

    Args:
        assessment: of the life.
        command: the command line that made it.
    """
    drawn = [_profiles(assessment), _curves(assessment)]
    beside = {
        "wear.json": "all numbers, in SI units, and the worn profiles over the strokes",
        "life.csv": "errors and depths over the strokes",
        "profiles.csv": "the worn profiles at the end",
    }
    return {
        "wear.json": _numbers(assessment, command),
        "life.csv": csv_lines(_life_columns(assessment), 9),
        "profiles.csv": csv_lines(_profile_columns(assessment), 9),
        "report.html": static_page(
            title=f"{assessment.linkage.name}: wear on {assessment.life.stroke.name}",
            command=command,
            sections=[
                Card("Life", tables(assessment.tables())),
                Card("Figures", figures(drawn)),
                Card("Files", downloads(beside, drawn)),
            ],
            numbers=_tiles(assessment),
            notes=assessment.notes,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _numbers(assessment: WearAssessment, command: str) -> str:
    """Return the text of wear.json; the many depths of its surfaces stand on one line."""
    text = json.dumps({"command": command, **assessment.as_data()}, indent=2, ensure_ascii=False).removesuffix("\n}")
    return f'{text},\n  "surfaces": {json.dumps(surfaces_data(assessment.life))}\n}}\n'


def _tiles(assessment: WearAssessment) -> Iterator[Tile]:
    yield Tile(f"{assessment.life.strokes[-1]:.3g}", "strokes")
    for name, limit, quantiles, _ in assessment.lives():
        if np.isfinite(quantiles["50 %"]):
            low, middle, high = quantiles.values()
            yield Tile(f"{middle:.3g}", f"strokes to {name} of {limit * 1e3:g} mm; nine in ten {low:.3g} to {high:.3g}")


def _life_columns(assessment: WearAssessment) -> dict[str, Array]:
    life = assessment.life
    columns = {"strokes": life.strokes}
    for name, (values, spread) in life.measures().items():
        columns[f"{name}_m"], columns[f"{name}_spread_m"] = values, spread
    for i, pin in enumerate(assessment.linkage.pins):
        columns[f"{pin.name}.bearing_m"] = np.array([surface.bearing[i].max() for surface in life.surfaces])
        columns[f"{pin.name}.journal_m"] = np.array([surface.journal[i].max() for surface in life.surfaces])
        columns[f"{pin.name}.volume_m3"] = life.volumes[:, i]
    return columns


def _profile_columns(assessment: WearAssessment) -> dict[str, Array]:
    last = assessment.life.surfaces[-1]
    columns = {"angle_rad": bin_angles(last.bearing.shape[1])}
    for i, pin in enumerate(assessment.linkage.pins):
        columns[f"{pin.name}.bearing_m"], columns[f"{pin.name}.journal_m"] = last.bearing[i], last.journal[i]
    return columns


def _profiles(assessment: WearAssessment) -> Drawing:
    pins, last = assessment.linkage.pins, assessment.life.surfaces[-1]
    radius = max(pin.journal_radius for pin in pins)
    factor = round_number(_DEPTH_SHARE * radius / max(float(last.deepest().max()), 1e-12))
    figure = empty_figure((3.1 * len(pins) + 1.0, 3.8))
    angles = np.append(bin_angles(last.bearing.shape[1]), 2 * np.pi)
    direction = np.stack([np.cos(angles), np.sin(angles)])
    for axis, i in zip(figure.subplots(1, len(pins), squeeze=False)[0], range(len(pins)), strict=True):
        r = pins[i].journal_radius * 1e3
        for sign, depth, label, colour in (
            (1, last.bearing[i], "bearing", "C0"),
            (-1, last.journal[i], "journal", "C3"),
        ):
            # The journal is drawn smaller, so that its wear does not cover that of the bearing.
            size = r if sign > 0 else 0.7 * r
            axis.plot(*(size * direction), color="C7", linewidth=0.8, linestyle=":")
            worn = size + sign * factor * np.append(depth, depth[0]) * 1e3
            axis.plot(*(worn * direction), color=colour, linewidth=1.4, label=label)
        axis.set(title=plain_label(pins[i].name), xlabel="along its body, mm")
        axis.set_aspect("equal")
        axis.grid(visible=True, alpha=0.3)
        handles = axis.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=2, frameon=False)
    caption = f"Worn profiles: depths magnified {factor:g} times, each in the axes of its own body"
    return Drawing("profiles", caption, svg_text(figure))


def _curves(assessment: WearAssessment) -> Drawing:
    figure, life = empty_figure((7.4, 4.4)), assessment.life
    axes = plain_axes(figure, "strokes", "error of the tip, mm")
    # The same error comes earlier or later, as the wear coefficient is; beyond the life nothing is known of it.
    fast, *_, slow = (np.exp(-z * assessment.spread) for z in QUANTILES.values())
    factors = np.geomspace(slow, fast, _BAND)
    known = np.linspace(0.0, float(life.strokes[-1]) / fast, _BAND)
    for k, (name, (values, _)) in enumerate(life.measures().items()):
        axes.plot(life.strokes, values * 1e3, f"C{k}-", label=name)
        band = np.array([np.interp(factor * known, life.strokes, values) for factor in factors]) * 1e3
        axes.fill_between(known, band.min(axis=0), band.max(axis=0), color=f"C{k}", alpha=0.15)
        if name in assessment.limits:
            axes.axhline(assessment.limits[name] * 1e3, color=f"C{k}", linestyle=":", linewidth=1)
    axes.set_xlim(0, float(life.strokes[-1]))
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small")
    return Drawing("life", "Errors over the strokes: bands hold nine in ten wear coefficients", svg_text(figure))
