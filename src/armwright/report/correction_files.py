"""The files of a corrected path: the path as a table, its numbers, and a figure of the tip before and after."""

import json
from collections.abc import Iterator

import numpy as np

from armwright.clearance.correction_assessment import CorrectionAssessment
from armwright.clearance.paths import named_path
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.simulation import simulate
from armwright.report.clearance_figures import paths
from armwright.report.motion_table import csv_lines

_COLUMNS = ("t_s", "x_mm", "y_mm", "vx_mm_per_s", "vy_mm_per_s", "ax_mm_per_s2", "ay_mm_per_s2")


def correction_files(assessment: CorrectionAssessment) -> dict[str, str | Iterator[str]]:
    """Return the files of a corrected path by name."""
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
    return {
        "path.csv": csv_lines(dict(zip(_COLUMNS, columns, strict=True)), 9),
        "summary.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "paths.svg": paths(f"{linkage.name}, {assessment.path}: with joint clearance", panels, targets),
    }
