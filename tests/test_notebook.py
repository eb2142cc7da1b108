"""What objects look like in a notebook: tables that parse, with names escaped."""

from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

import armwright as aw

EXAMPLES = Path(__file__).parents[1] / "examples"
VOID = {"br", "hr"}


class Balanced(HTMLParser):
    """Collects the texts of cells, and checks that every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cells: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002 - the base has it
        """Open an element."""
        self.open += [] if tag in VOID else [tag]
        self.cells += [""] if tag in ("td", "p") else []

    def handle_endtag(self, tag: str) -> None:
        """Close the element that was opened last."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Add to the text of the cell."""
        if self.open and self.open[-1] in ("td", "p"):
            self.cells[-1] += data


def cells(shown: Any) -> list[str]:
    parser = Balanced()
    parser.feed(shown._repr_html_())
    assert not parser.open
    return parser.cells


@pytest.fixture(scope="module")
def arm() -> aw.Arm:
    return aw.load_arm("puma560")


def test_arm(arm: aw.Arm) -> None:
    """An arm shows a row for each joint, with its parameters."""
    assert "0.432" in cells(arm)
    assert len(cells(arm)) == 12 * arm.n


def test_names_are_escaped(arm: aw.Arm) -> None:
    """What a file calls an arm is text on the page."""
    named = attrs.evolve(arm, title="<script>alert(1)</script>")

    assert "<script" not in named._repr_html_()
    assert "&lt;script&gt;" in named._repr_html_()


def test_inverse_solution(arm: aw.Arm) -> None:
    """An inverse solution shows each branch, and which joint is outside its limits."""
    solution = aw.kinematics.inverse(arm, aw.kinematics.forward(arm, [0.1, 0.6, 0.2, 0.3, 0.9, 0.0]))
    shown = cells(solution)

    assert sum(branch.label in shown for branch in solution.branches) == len(solution.branches)
    assert any("beyond its limit" in cell for cell in shown)


def test_motion(arm: aw.Arm) -> None:
    """A trajectory shows a row for each joint, a certificate what is kept."""
    q = np.array([0.1, 0.6, 0.2, 0.3, 0.9, 0.0])
    X = aw.kinematics.forward(arm, q)
    X[2, 3] += 0.05
    line = aw.motion.straight_line(arm, q, X)

    assert len(cells(line.trajectory)) == 7 * arm.n
    assert cells(line.certificate)[0].startswith("holds")


def test_calibration() -> None:
    """A calibration shows every fitted parameter with its standard error."""
    arm = aw.load_arm("puma560-seed")
    found = aw.calibration.calibrate(arm, aw.calibration.read_measurements(EXAMPLES / "puma_points.csv", arm).readings)

    assert cells(found)[::3] == list(found.names)


def test_recording() -> None:
    """A recording shows its effects; of very many the first hundred, and how many more."""
    recording = aw.program.run(EXAMPLES / "stacking.rlo", EXAMPLES / "stanford_cell.toml")
    many = attrs.evolve(recording, effects=recording.effects * 50)

    assert cells(recording)[3] == recording.effects[0].text
    assert f"and {50 * len(recording.effects) - 100} more" in cells(many)
