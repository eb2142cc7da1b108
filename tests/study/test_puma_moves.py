"""The project on the PUMA's trajectories: its formulas, its figures, and what its moves ask of the joints."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.blends import via_deviations, via_distances
from armwright.study import puma_moves
from armwright.study.puma_moves import (
    BLEND,
    CURVES,
    PRINTED_POSITIONS_CM,
    PRINTED_Q,
    PRINTED_ROTATIONS,
    SAMPLES,
    TIMES,
    AngleRow,
    ConfigurationRow,
    MoveRow,
    angle_table,
    figure_panels,
    joints_along,
    path_of,
    sample_times,
    study_poses,
)
from armwright.study.puma_moves_study import PumaMoves
from cli_calls import armwright

pytestmark = pytest.mark.early

ROUNDING = 1e-12


@pytest.fixture(scope="module")
def study() -> PumaMoves:
    """The study, run once for its tables and for the command that prints them."""
    return PumaMoves.run()


@pytest.fixture
def configurations(study: PumaMoves) -> dict[str, ConfigurationRow]:
    return {row.pose: row for row in study.configurations}


@pytest.fixture
def angles(study: PumaMoves) -> dict[str, AngleRow]:
    return {row.pose: row for row in study.angles}


@pytest.fixture
def moves(study: PumaMoves) -> dict[str, MoveRow]:
    return {row.name: row for row in study.moves}


def of_the_project(A: Array, B: Array, C: Array, t: float) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration by the three formulas of the project's programs."""
    if t < 0.3:
        return (B - A) * t / 0.5 + A, (B - A) / 0.5, 0 * A
    if t > 0.7:
        return B + (C - B) * (t - 0.5) / 0.5, (C - B) / 0.5, 0 * A
    h = (t - 0.5 + 0.2) / 0.4
    a0 = (B - A) * 0.3 / 0.5 + A
    a1 = (B - a0) / 0.5
    # The project writes (B - a0)/0.5 for 2 t_acc (B - A)/T: both are 0.8 (B - A).
    a3 = 2 * (a0 - B) + 0.8 * (C - B)
    a4 = -0.5 * a3
    return (
        a0 + a1 * h + a3 * h**3 + a4 * h**4,
        (a1 + 3 * a3 * h**2 + 4 * a4 * h**3) / 0.4,
        (6 * a3 * h + 12 * a4 * h**2) / 0.16,
    )


def test_the_projects_formulas() -> None:
    """Every sample of figures 5 to 7 and 16 to 18 is what the project's own formulas give."""
    q, places = np.array(PRINTED_Q), np.array(PRINTED_POSITIONS_CM, dtype=np.float64)
    turns = np.array([row.matlab for row in angle_table()])
    for number, (way, order) in CURVES.items():
        shown = [curve for panel in figure_panels(number) for curve in panel.lines.values()]
        points = q if way == "joint" else np.concatenate([places, turns], axis=1)
        expected = np.array([of_the_project(*points, t)[order] for t in sample_times()]).T
        np.testing.assert_allclose(shown, expected, rtol=ROUNDING, atol=1e-8)


def test_no_other_figures_have_curves() -> None:
    """A figure of the project without curves is refused."""
    with pytest.raises(UnknownNameError, match="no figure '10'"):
        figure_panels(10)
    with pytest.raises(UnknownNameError, match="no Cartesian move 'joint'"):
        path_of("joint")


def test_samples() -> None:
    """There are 501 samples, 2 ms apart, over one second."""
    t = sample_times()

    assert (len(t), t[0], t[-1]) == (SAMPLES, 0.0, 1.0)
    assert np.diff(t).max() == pytest.approx(0.002)


def test_printed_configurations(configurations: dict[str, ConfigurationRow]) -> None:
    """A comes out to the printed digits; B and C as far as two digits of their rotations reach, beside the wrist."""
    assert configurations["A"].farthest < 0.5e-4
    assert configurations["B"].farthest < 1.0
    assert configurations["C"].farthest < 0.3
    for printed, R, place in zip(PRINTED_Q, PRINTED_ROTATIONS, PRINTED_POSITIONS_CM, strict=True):
        X = forward(load_arm("puma560"), np.radians(printed))
        np.testing.assert_allclose(X[:3, 3] * 100, place, atol=5e-4)
        # Rounded to two digits, as the project prints them; one of C's is off by two units of the last one.
        np.testing.assert_allclose(X[:3, :3], R, atol=0.011)


def test_no_branch_for_all(configurations: dict[str, ConfigurationRow]) -> None:
    """A can be held with the wrist one way only, C with the other: every move must turn it over."""
    assert configurations["A"].allowed == ("left, down, no-flip",)
    assert configurations["C"].allowed == ("left, down, flip",)


def test_matlab_angles(angles: dict[str, AngleRow]) -> None:
    """MATLAB's angles of A, where theta is half a turn, and the nearest ones, which turn far less on the way to B."""
    np.testing.assert_allclose(angles["A"].matlab, (0, -180, 180 - np.degrees(np.arctan(0.77 / 0.64))), atol=1e-9)
    way = {
        name: np.abs(np.subtract(getattr(angles["B"], name), getattr(angles["A"], name))).sum()
        for name in ("matlab", "nearest")
    }
    assert way["nearest"] < way["matlab"] / 2


def test_missed_by_the_formula() -> None:
    """At B the joint move is off by 3/16 · blend · (change of the rate), which is where its curve is."""
    B = puma_moves.joint_trajectory()(0.5) - np.radians(PRINTED_Q[1])

    deviations = via_deviations(TIMES, np.radians(PRINTED_Q), BLEND, ends="running")
    np.testing.assert_allclose(deviations[1], B, atol=ROUNDING)


def test_the_two_kinds_of_move(moves: dict[str, MoveRow]) -> None:
    """The project's discussion in numbers: the joint move solves 3 poses and swings out wide, the Cartesian 501."""
    joint, seed, nearest, geodesic = moves.values()

    assert (joint.inverse, seed.inverse) == (3, 501)
    # The hand of a Cartesian move leaves the straight ways by its blend alone, and no more than it misses B.
    miss = via_distances(TIMES, study_poses()[:, :3, 3], BLEND, ends="running")[1]
    for row in (seed, nearest, geodesic):
        assert 0 < row.deviation <= miss
        assert row.length < joint.length
        assert joint.deviation > 3 * row.deviation
    assert geodesic.rotation <= nearest.rotation < seed.rotation / 2
    assert joint.joints < geodesic.joints < nearest.joints < seed.joints


def test_what_the_wrist_would_have_to_do(moves: dict[str, MoveRow]) -> None:
    """In a Cartesian move joints of the wrist would run many times over their limits; the joint move just its own."""
    joint, *cartesian = moves.values()

    assert joint.stopped == ""
    assert 1 < joint.speed.part < 2
    for row in cartesian:
        assert row.speed.part > 30
        assert row.speed.joint in {4, 6}
        assert "no single branch of the inverse kinematics can be followed to the last pose" in row.stopped


@pytest.mark.parametrize("way", ["seed", "zyz", "geodesic"])
def test_joints_follow_the_hand(way: str) -> None:
    """Without limits the joints put the hand at every one of the 501 poses."""
    X = path_of(way)(sample_times())  # type: ignore[arg-type]

    q = joints_along(way)(sample_times())  # type: ignore[arg-type]
    found = forward(load_arm("puma560"), np.remainder(q, 2 * np.pi))

    np.testing.assert_allclose(found, X, atol=1e-7)


def test_ways_round(study: PumaMoves) -> None:
    """From B to C the wrist is turned over: a via pose near the joint move does it, and damped rates, at a price."""
    via, damped = study.detours

    for row in (via, damped):
        assert row.exists
        assert "mm off the line" in row.summary


def test_command(study: PumaMoves, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command leaves ten figures, a film and the study's tables, and says what stops which move."""
    monkeypatch.setattr(PumaMoves, "run", lambda _progress: study)

    done = armwright("study", "puma-moves", "-o", tmp_path, columns=200)

    assert done.returncode == 0, done.stderr
    numbers = (5, 6, 7, 10, 16, 17, 18, 19, 22, 23)
    names = {f"figure{number:02d}.svg" for number in numbers}
    assert {path.name for path in tmp_path.iterdir()} - {"figure25.mp4"} == names | {
        "figure25.gif",
        "tables.json",
        "report.html",
        "run.json",
    }
    for name in names:
        assert ET.parse(tmp_path / name).getroot().tag.endswith("svg")
    tables = json.loads((tmp_path / "tables.json").read_text())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<figcaption>Figure (\d+):", page) == [*map(str, numbers), "25"]
    assert page.count('<img src="data:image/gif;base64,') == 1
    assert f"<b>{tables['moves'][0]['slower']:.1f} x</b><small>slower within the limits: joint move</small>" in page
    assert [row["inverse"] for row in tables["moves"]] == [3, 501, 501, 501]
    assert "no single branch of the inverse kinematics can be followed to the last pose" in done.stdout
