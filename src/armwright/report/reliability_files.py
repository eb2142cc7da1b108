"""The files of the reliability of a linkage: a page, its numbers, and curves with their bands."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from armwright.reliability.linkage_assessment import LinkageReliability
from armwright.reliability.linkage_life import LinkageLife
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.motion_table import csv_lines
from armwright.report.static_page import static_page

# Smaller probabilities are drawn as this one.
_LEAST = 1e-100
_NAMES = {"error": "error of the tip", "RP": "repeatability RP"}


def reliability_files(assessment: LinkageReliability, *, command: str) -> dict[str, Any]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the linkage.
        command: the command line that made it.
    """
    drawn = list(_drawings(assessment))
    beside = {"reliability.json": "all numbers, in SI units"}
    beside |= {
        _csv_name(life): f"probability of failure over the strokes, by {life.measure}" for life in assessment.lives
    }
    cards = [Card("Reliability", tables(assessment.tables()))]
    if drawn:
        cards.append(Card("Figures", figures(drawn)))
    cards.append(Card("Files", downloads(beside, drawn)))
    return {
        "reliability.json": json.dumps({"command": command, **assessment.as_data()}, indent=2, ensure_ascii=False)
        + "\n",
        **{_csv_name(life): csv_lines(_columns(life), 9) for life in assessment.lives},
        "report.html": static_page(
            title=f"{assessment.linkage.name}: reliability",
            command=command,
            sections=cards,
            numbers=_tiles(assessment),
            notes=assessment.notes,
        ),
        **{drawing.name + ".svg": drawing.svg for drawing in drawn},
    }


def _csv_name(life: LinkageLife) -> str:
    return f"life-{life.measure.lower()}.csv"


def _columns(life: LinkageLife) -> dict[str, Any]:
    strokes, probability, (low, high) = life.curve()
    return {"strokes": strokes, "probability": probability, "low": low, "high": high}


def _tiles(assessment: LinkageReliability) -> Iterator[Tile]:
    if assessment.limit is not None and assessment.on_path is not None:
        text = f"probability of more than {assessment.limit * 1e3:g} mm"
        yield Tile(f"{assessment.on_path.probability:.2g}", f"{text} at any pose")
    for life in assessment.lives:
        if np.isfinite(life.quantile(0.1)):
            yield Tile(f"{life.quantile(0.1):.3g}", f"strokes, B10, {_NAMES[life.measure]} {life.limit * 1e3:g} mm")
    if assessment.lives:
        parts = assessment.lives[0].pin_parts()
        first = int(parts.argmax())
        yield Tile(assessment.linkage.pins[first].name, f"pin that counts most, {parts[first]:.0%} of the growth")


def _drawings(assessment: LinkageReliability) -> Iterator[Drawing]:
    if assessment.at_poses is not None and len(assessment.labels) > 2:
        yield Drawing("poses", "Probability by pose: that of the new linkage", _poses(assessment))
    for life in assessment.lives:
        name = life.measure.lower()
        yield Drawing(
            f"failure-{name}",
            f"Probability of failure over the strokes, {_NAMES[life.measure]}: the band holds nine in ten wear "
            "coefficients",
            _failure(life),
        )
        yield Drawing(
            f"growth-{name}",
            f"Growth of the {_NAMES[life.measure]}: median, and nine in ten linkages",
            _growth(life),
        )


def _poses(assessment: LinkageReliability) -> str:
    figure = empty_figure((7.4, 3.8))
    axes = plain_axes(figure, "pose", "probability")
    assert assessment.at_poses is not None  # noqa: S101 - drawn only then
    shown = np.maximum(assessment.at_poses, _LEAST)
    axes.plot(np.arange(1, len(shown) + 1), shown, "o-", markersize=3)
    axes.set_yscale("log")
    axes.set_ylim(top=min(10 * shown.max(), 2.0))
    return svg_text(figure, "Probability by pose")


def _failure(life: LinkageLife) -> str:
    figure = empty_figure((7.4, 3.8))
    axes = plain_axes(figure, "strokes", "probability of failure")
    strokes, probability, (low, high) = life.curve()
    axes.fill_between(strokes, low, high, color="C0", alpha=0.2, label="nine in ten wear coefficients")
    axes.plot(strokes, probability, color="C0", label="with the wear coefficient unknown")
    for part, name in ((0.1, "B10"), (0.5, "B50")):
        at = life.quantile(part)
        if np.isfinite(at):
            axes.plot([at], [part], "o", color="C3", markersize=4)
            axes.annotate(name, (at, part), (6, -10), textcoords="offset points", fontsize="small")
    axes.set_xlim(left=0)
    axes.set_ylim(0, 1)
    axes.legend(fontsize="small")
    return svg_text(figure, "Probability of failure over the strokes")


def _growth(life: LinkageLife) -> str:
    figure = empty_figure((7.4, 3.8))
    axes = plain_axes(figure, "strokes", f"{_NAMES[life.measure]}, mm")
    strokes = life.curve()[0][::3]
    low, middle, high = life.values(strokes) * 1e3
    axes.fill_between(strokes, low, high, color="C2", alpha=0.2, label="nine in ten linkages")
    axes.plot(strokes, middle, color="C2", label="median")
    axes.axhline(life.limit * 1e3, color="C7", linestyle=":", label="limit")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small")
    return svg_text(figure, "Growth over the strokes")
