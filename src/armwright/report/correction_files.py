"""The files of a corrected path: the path as a table, its numbers, a figure of the tip before and after, a page."""

import json
from collections.abc import Iterator

import numpy as np

from armwright.clearance.correction_assessment import CorrectionAssessment
from armwright.clearance.paths import named_path
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.simulation import simulate
from armwright.report.clearance_figures import paths
from armwright.report.elements import Card, Tile, downloads, figures, length_text, tables
from armwright.report.figures import Drawing
from armwright.report.motion_table import csv_lines
from armwright.report.static_page import static_page

_COLUMNS = ("t_s", "x_mm", "y_mm", "vx_mm_per_s", "vy_mm_per_s", "ax_mm_per_s2", "ay_mm_per_s2")
# What lies beside the page.
_BESIDE = {
    "path.csv": "the corrected path over time",
    "summary.json": "nodes and errors, in SI units",
    "paths.svg": "the paths and what happens around the targets",
}


def correction_files(assessment: CorrectionAssessment, *, command: str) -> dict[str, str | Iterator[str]]:
    """Return the files of a corrected path by name.

    Args:
        assessment: of the correction.
        command: the command line that made it.
    """
    linkage, path, goal = assessment.linkage, assessment.correction.path, named_path(assessment.path)
    run = assessment.run
    original = simulate(prepare_scenario(linkage, goal, run.scenario.settings), run.clearances)
    times = np.linspace(0.0, path.duration, 1001)
    columns = np.column_stack([times, *(x * 1e3 for x in path.evaluate(times))]).T
    line = goal.evaluate(times).position * 1e3
    panels = {
        "original path": {"goal": line, "taken": original.tip * 1e3},
        "corrected path": {"goal": line, "taken": run.tip * 1e3},
    }
    targets = goal.evaluate(np.array(goal.targets)).position * 1e3
    title = f"{linkage.name}, {assessment.path}: with joint clearance"
    caption = "The original and the corrected path: goal, path taken, and below what happens around each target"
    drawn = Drawing("paths", caption, paths(title, panels, targets))
    return {
        "path.csv": csv_lines(dict(zip(_COLUMNS, columns, strict=True)), 9),
        "summary.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=f"{linkage.name}: {assessment.path}, corrected",
            command=command,
            sections=[
                Card("Errors at the targets", tables(assessment.tables())),
                Card("Paths", figures([drawn])),
                Card("Files", downloads(_BESIDE)),
            ],
            numbers=_tiles(assessment),
            notes=assessment.notes,
        ),
        "paths.svg": drawn.svg,
    }


def _tiles(assessment: CorrectionAssessment) -> Iterator[Tile]:
    """Give the mean error at the targets before and after, and until when a run is a prediction."""
    data = assessment.as_data()
    for key, arrow, text in (("before", "", "original path"), ("after", "\N{RIGHTWARDS ARROW} ", "corrected path")):
        yield Tile(f"{arrow}{length_text(float(np.mean(data[key])))}", f"mean error at the targets, {text}")
    yield Tile(length_text(max(data["after_spread"])), f"largest spread over {data['runs']} runs, corrected path")
