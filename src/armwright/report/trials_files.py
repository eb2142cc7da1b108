"""The files of the trials of a program: numbers, the histogram of placing errors, and a page."""

from __future__ import annotations

import json

import numpy as np

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
    low, high = summary.interval
    files["report.html"] = static_page(
        title=f"{summary.program}: trials",
        command=command,
        tables=summary.tables(),
        drawn=drawn,
        notes=summary.notes,
        named=[
            ("cell", summary.cell),
            ("trials", str(len(summary.trials))),
            ("seed", str(summary.seed)),
            ("success", f"{summary.success:.1%}"),
            ("95 % interval", f"{low:.1%} to {high:.1%}"),
        ],
    )
    return files


def _histogram(summary: TrialsSummary) -> str:
    """Draw the histogram of placing errors as an SVG file's text."""
    edges, counts = summary.histogram()
    figure = empty_figure((7, 3.6))
    axes = plain_axes(figure, "distance from the goal [mm]", "trials")
    axes.bar(edges[:-1] * 1e3, counts, np.diff(edges) * 1e3, align="edge", edgecolor="white")
    axes.set(title=figure_title(figure, f"{summary.program}: placing errors"), xlim=(0.0, float(edges[-1]) * 1e3))
    axes.locator_params(axis="y", integer=True)
    return svg_text(figure)
