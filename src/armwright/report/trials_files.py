"""The files of the trials of a program: numbers, the histogram of placing errors, and a page."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, figure_title, plain_axes, svg_text
from armwright.report.static_page import static_page
from armwright.report.trials_summary import TrialsSummary


def trials_files(summary: TrialsSummary, *, command: str) -> dict[str, str]:
    """Return the files of trials by name.

    Args:
        summary: of the trials.
        command: the command line that ran them.
    """
    files = {"trials.json": json.dumps(summary.as_data(), indent=2, ensure_ascii=False) + "\n"}
    drawn = []
    if summary.distances.size:
        drawn = [Drawing("errors", "Distances of parts from their goals at the end", _histogram(summary))]
        files["errors.svg"] = drawn[0].svg
    beside = {"trials.json": "every trial with its seed, error and cause"}
    if drawn:
        beside["errors.svg"] = "the histogram of placing errors"
    files["report.html"] = static_page(
        title=f"{summary.program}: trials",
        command=command,
        sections=[
            *([Card("Failures", tables(summary.tables()))] if summary.failures else []),
            *([Card("Placing errors", figures(drawn))] if drawn else []),
            Card("Files", downloads(beside)),
        ],
        numbers=_tiles(summary),
        notes=summary.notes,
        named=[("Cell", summary.cell), ("Trials", str(len(summary.trials))), ("Seed", str(summary.seed))],
    )
    return files


def _tiles(summary: TrialsSummary) -> Iterator[Tile]:
    """Give the share of success with its interval, and the placing errors."""
    low, high = summary.interval
    yield Tile(f"{summary.success:.1%}", f"success, {summary.successes} of {len(summary.trials)} trials")
    yield Tile(f"{low:.1%} to {high:.1%}", "95 % interval of the probability of success")
    errors = summary.as_data()["errors_mm"]
    for key, label in (("median", "median placing error"), ("p95", "95 % of placing errors below")):
        if errors[key] is not None:
            yield Tile(f"{errors[key]:.3g} mm", label)


def _histogram(summary: TrialsSummary) -> str:
    """Draw the histogram of placing errors as an SVG file's text."""
    edges, counts = summary.histogram()
    figure = empty_figure((7, 3.6))
    axes = plain_axes(figure, "distance from the goal [mm]", "trials")
    axes.bar(edges[:-1] * 1e3, counts, np.diff(edges) * 1e3, align="edge", edgecolor="white")
    axes.set(title=figure_title(figure, f"{summary.program}: placing errors"), xlim=(0.0, float(edges[-1]) * 1e3))
    axes.locator_params(axis="y", integer=True)
    return svg_text(figure)
