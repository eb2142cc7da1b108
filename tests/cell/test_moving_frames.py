"""Frames of a cell file that move by themselves."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from armwright.cell.model import Cell
from armwright.cell.moving_frames import MovingFrame
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError
from samples import Sample

ARM = "[arms.ARM_1]\njoint_positions = [0.0, 0.5, 0.3, 0.0, 0.6, 0.0]\n"
AT = "at = [0, 1, 0,  -1, 0, 0,  0, 0, 1,   0.4, -0.5, 0.1]"


def read(folder: Path, moves: str, more: str = "") -> Cell:
    """The cell with a belt that moves so."""
    path = folder / "cell.toml"
    path.write_text(f"{ARM}[frames.BELT]\n{AT}\nmoves = {{ {moves} }}\n{more}", encoding="utf-8")
    return read_cell(path)


def test_moving_frame(tmp_path: Path) -> None:
    """Direction along the axes of the frame, millimetres, and the usual values."""
    frame = read(tmp_path, "speed_mm_per_s = 100, window_mm = [50, 300], along = [3, 0, 4]").moving_frames["BELT"]

    np.testing.assert_allclose(frame.direction, (0.0, 0.6, 0.8), atol=1e-12)
    assert (frame.speed, frame.changes, frame.window) == (0.1, (), (0.05, 0.3))
    np.testing.assert_allclose(frame.pose_at(2.0)[:3, 3], (0.4, -0.38, 0.26), atol=1e-12)
    assert frame.rests_from is None
    assert read(tmp_path, "speed_mm_per_s = 9, window_mm = [0, 1], timeline = [[2, 0]]").moving_frames[
        "BELT"
    ].rests_from == pytest.approx(2.5)


def test_travel(sample: Sample) -> None:
    """The travel is the integral of the speed, which changes by 3 x^2 - 2 x^3 in each ramp."""
    for random in sample.cases(50):
        ramp, speeds = random.uniform(0.1, 1.0), random.uniform(-1, 1, 4)
        times = np.cumsum(ramp + random.uniform(0, 1, 3))
        changes = tuple(zip(times.tolist(), speeds[1:].tolist(), strict=True))
        fields = {"pose": np.eye(4), "direction": np.array([1.0, 0.0, 0.0]), "window": (0.0, 1.0)}
        frame = MovingFrame(**fields, speed=float(speeds[0]), changes=changes, ramp=ramp)

        def speed(t: float, changes: tuple = changes, ramp: float = ramp, first: float = speeds[0]) -> float:
            now = first
            for time, goal in changes:
                x = min(max((t - time) / ramp, 0.0), 1.0)
                now += (goal - now) * (3 * x**2 - 2 * x**3)
            return float(now)

        end = random.uniform(0.0, times[-1] + 2)
        corners = [time for one in times for time in (one, one + ramp) if time < end]
        expected = quad(speed, 0.0, end, points=corners or None, limit=200)[0]
        assert frame.travel(np.array([end]))[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("moves", "more", "says"),
    [
        ("window_mm = [0, 1]", "", "speed_mm_per_s"),
        ("speed_mm_per_s = 1", "", "window_mm"),
        ("speed_mm_per_s = 1, window_mm = [2, 1]", "", "two places that increase"),
        ("speed_mm_per_s = 1, window_mm = [0, 1], along = [0, 0, 0]", "", "a direction"),
        ("speed_mm_per_s = 1e5, window_mm = [0, 1]", "", "speed_mm_per_s"),
        ("speed_mm_per_s = 1, window_mm = [0, 1], ramp_s = 0", "", "ramp_s"),
        ("speed_mm_per_s = 1, window_mm = [0, 1], timeline = [[1, 2], [1.2, 3]]", "", "a time from 1.5"),
        ("speed_mm_per_s = 1, window_mm = [0, 1], timeline = [[1, 1e6]]", "", "a speed within"),
        ("speed_mm_per_s = 1, window_mm = [0, 1], timline = [[1, 2]]", "", "timeline"),
        (
            "speed_mm_per_s = 1, window_mm = [0, 1]",
            f'[frames.TRAY]\n{AT}\non = "BELT"\nmoves = {{ speed_mm_per_s = 1, window_mm = [0, 1] }}\n',
            "must stand",
        ),
        (
            "speed_mm_per_s = 1, window_mm = [0, 1]",
            f'[frames.TRAY]\n{AT}\non = "ARM_1"\nmoves = {{ speed_mm_per_s = 1, window_mm = [0, 1] }}\n',
            "must stand",
        ),
    ],
)
def test_wrong_entries(tmp_path: Path, moves: str, more: str, says: str) -> None:
    """Each is one message with the file and the key."""
    with pytest.raises(FileFormatError, match=says):
        read(tmp_path, moves, more)
