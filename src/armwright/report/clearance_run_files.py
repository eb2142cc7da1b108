"""The files of a clearance run: its summary, its samples as a table, a page and its figures."""

import json
from collections.abc import Iterator
from typing import Any

import attrs

from armwright.arrays import Array
from armwright.clearance.assessment import ClearanceRun
from armwright.clearance.energy_balance import ENERGY_OF_RODS, EnergyBalance
from armwright.report.clearance_run_figures import clearance_run_figures
from armwright.report.clearance_run_page import clearance_run_page
from armwright.report.five_bar_figure import scenario_workspace
from armwright.report.motion_table import csv_lines


def clearance_run_files(run: ClearanceRun, *, command: str) -> dict[str, Any]:
    """Return the files of a run by name.

    Args:
        run: the run.
        command: the command line that made it.
    """
    scenario = run.simulation.scenario
    space = scenario_workspace(scenario)
    drawn = [*clearance_run_figures(run), *([space] if space else [])]
    title = f"{scenario.linkage.name}: {scenario.path.name}"
    return {
        "summary.json": json.dumps({"command": command, **run.as_data()}, indent=2, ensure_ascii=False) + "\n",
        "samples.csv": samples_csv(run),
        "report.html": clearance_run_page(run, drawn, title=title, command=command),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def samples_csv(run: ClearanceRun) -> Iterator[str]:
    """Give the lines of samples.csv, in SI; every column has its unit in its name."""
    simulation = run.simulation
    linkage, rows = simulation.scenario.linkage, slice(run.rows)
    columns: dict[str, Array] = {"time_s": run.time}
    columns["tip_x_m"], columns["tip_y_m"] = simulation.tip[rows].T
    columns["error_x_m"], columns["error_y_m"] = run.error.T
    columns["error_m"] = run.distance
    for i, coordinate in enumerate(linkage.coordinates):
        unit = "rad" if coordinate.kind == "angle" else "m"
        columns[f"{coordinate}_{unit}"] = simulation.q[rows, i]
        columns[f"{coordinate}_speed_{unit}/s"] = simulation.qd[rows, i]
    for i, pin in enumerate(linkage.pins):
        columns[f"{pin.name}.gap_x_m"], columns[f"{pin.name}.gap_y_m"] = run.gaps[rows, i].T
        columns[f"{pin.name}.depth_m"] = run.depths[rows, i]
        columns[f"{pin.name}.force_N"] = simulation.forces[rows, i]
    for field in attrs.fields(EnergyBalance):
        if field.name in ENERGY_OF_RODS and not linkage.rods:
            continue
        columns[f"{field.name}_J"] = getattr(run.energy, field.name)[rows]
    return csv_lines(columns, 10)
