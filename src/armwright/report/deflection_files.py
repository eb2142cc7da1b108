"""The files of an assessment of static deflection: a page, its numbers, corrected positions, and a figure."""

import csv
import io
import json

import numpy as np

from armwright.dynamics.deflection_assessment import DeflectionAssessment
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.static_page import static_page


def deflection_files(assessment: DeflectionAssessment, *, command: str) -> dict[str, str]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the deflection.
        command: the command line that made it.
    """
    drawing = Drawing("displacement", "displacement of the tool, and the part of each joint", _figure(assessment))
    beside = {
        "deflection.json": "displacement, loads and deflections of every configuration",
        "compensated.csv": "joint positions with which the tool comes where it is in the rigid arm, in rad and m",
        "displacement.svg": drawing.caption,
    }
    largest, joint = float(assessment.lengths.max()), assessment.most_yielding_joint
    return {
        "deflection.json": json.dumps(assessment.as_data(), indent=2) + "\n",
        "compensated.csv": _positions(assessment),
        "report.html": static_page(
            title=f"Static deflection of {assessment.arm.name}",
            command=command,
            sections=[
                Card("Deflection", tables(assessment.tables())),
                Card("Figures", figures([drawing])),
                Card("Files", downloads(beside)),
            ],
            numbers=[
                Tile(f"{largest * 1e3:.3f} mm", "largest displacement of the tool"),
                Tile(assessment.arm.joint_label(joint), "yields most there"),
            ],
            notes=assessment.notes,
            warnings=(),
            verdict=None,
        ),
        "displacement.svg": drawing.svg,
    }


def _positions(assessment: DeflectionAssessment) -> str:
    """Return the corrected joint positions as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([f"q{i + 1}" for i in range(assessment.arm.n)])
    writer.writerows(assessment.compensated.q.tolist())
    return text.getvalue()


def _figure(assessment: DeflectionAssessment) -> str:
    figure = empty_figure((7.4, 4.0))
    axes = plain_axes(figure, "row", "displacement of the tool, mm")
    rows, marker = np.arange(1, len(assessment.q) + 1), "o" if len(assessment.q) == 1 else ""
    axes.plot(rows, assessment.lengths * 1e3, "-", marker=marker, color="0.2", label="all joints")
    for i in range(assessment.arm.n):
        if assessment.compliance[i].any():
            axes.plot(rows, assessment.deflection.shares[:, i] * 1e3, "-", marker=marker, label=f"joint {i + 1}")
    axes.legend(fontsize="small", ncols=2)
    return svg_text(figure, "Displacement of the tool")
