"""Parts that lie on frames that move by themselves: where they are, what meets them, and what takes them."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.moving_frames import MovingFrame
from armwright.cell.part_poses import PartPoses
from armwright.cell.reader import read_cell
from armwright.cell.scene import Fixture
from armwright.errors import FileFormatError, InvalidValueError
from armwright.motion.trajectory import Trajectory
from armwright.physics.collisions import CellCollisions
from armwright.physics.frame_slides import frame_course, part_on_slide, slide_base
from armwright.physics.world import PhysicsCell
from armwright.program import Source, run
from armwright.program.vm.recording import Recording
from armwright.report.body_poses import part_poses
from armwright.report.run_scene import moved_parts
from armwright.report.shape_table import ShapeTable
from armwright.spatial.poses import from_noap
from program.running import failure, printed
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
BELT = """
[arms.ARM_1]
model = "ur5"
tool = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0.00, 0.00, 0.12]
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.00, 0.25]
gripper = {{ opening_mm = 80 }}

[frames.BELT]
at = [0, 1, 0,  -1, 0, 0,  0, 0, 1,   0.45,-0.40, 0.20]
moves = {{ speed_mm_per_s = {speed}, timeline = [[0.4, {later}]], window_mm = [0, 900], ramp_s = 0.3 }}
"""
BALL = """
[parts.BALL]
shape = "sphere"
diameter_mm = 80
mass_kg = 0.1
on = "BELT"
at = [1, 0, 0,  0, 1, 0,  0, 0, 1,   {x}, {y}, 0.0]
"""


def cell_with(folder: Path, text: str) -> Cell:
    """The cell of a file with this text."""
    path = folder / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return read_cell(path)


def moving_frame(rng: np.random.Generator) -> MovingFrame:
    """A frame that changes its speed three times."""
    ramp, direction = rng.uniform(0.1, 0.5), rng.normal(size=3)
    times = np.cumsum(ramp + rng.uniform(0, 1, 3))
    return MovingFrame(
        pose=from_noap([0, 1, 0, -1, 0, 0, 0, 0, 1, *rng.normal(size=3)]),
        direction=direction / np.linalg.norm(direction),
        speed=float(rng.uniform(-1, 1)),
        changes=tuple(zip(times.tolist(), rng.uniform(-1, 1, 3).tolist(), strict=True)),
        ramp=ramp,
        window=(0.0, 1.0),
    )


def test_slides(sample: Sample) -> None:
    """What lies on the slide that stands for a frame is where it lies on the frame, at any time."""
    for rng in sample.cases(100):
        frame, now, duration = moving_frame(rng), rng.uniform(0, 3), rng.uniform(0, 4)
        X_FP = from_noap([0, 0, 1, 0, 1, 0, -1, 0, 0, *rng.normal(size=3)])
        course = frame_course(frame, now, duration)
        for t in rng.uniform(0, duration, 5):
            X_WS = slide_base(frame)
            X_WS[:3, 3] += X_WS[:3, 2] * course(t)[0]
            np.testing.assert_allclose(
                X_WS @ part_on_slide(frame, X_FP), frame.pose_at(now + t) @ X_FP, rtol=0, atol=1e-9
            )
        assert course.duration == pytest.approx(duration)


def least_distance(cell: Cell, motion: Trajectory, t0: float) -> float:
    """The least distance of the arm from a body of the scene at many times, which stands where the ball is then."""
    ball, frame = cell.parts["BALL"], cell.moving_frames["BELT"]
    X_FP = np.linalg.inv(frame.pose) @ ball.pose

    def at(t: float) -> float:
        stands = Fixture(name="BALL", shape=ball.shape, pose=frame.pose_at(t0 + t) @ X_FP)
        standing = attrs.evolve(cell, parts={}, fixtures={"BALL": stands})
        checks = CellCollisions(standing).at_configurations(PartPoses(standing))
        return float(checks.distances_of({"ARM_1": motion(t)}, 0.3).min(initial=np.inf))

    times, step = np.linspace(0, motion.duration, 31, retstep=True)
    nearest = times[np.argmin([at(t) for t in times])]
    return min(at(t) for t in np.linspace(nearest - step, nearest + step, 31))


@pytest.mark.share(0.01)
def test_no_meeting_is_missed(tmp_path: Path, sample: Sample) -> None:
    """A MOVE past a ball on a belt is refused just where sampling finds that they meet, with the belt running."""
    met = 0
    for rng in sample.cases(100):
        belt = BELT.format(speed=rng.uniform(0, 400), later=rng.uniform(-200, 600))
        ball = BALL.format(x=rng.uniform(0.0, 0.5), y=rng.uniform(-0.1, 0.1))
        angle, away, z = rng.uniform((-0.7, 380, 200), (0.7, 520, 350)).round(1)
        x, y = (away * np.array([np.cos(angle), np.sin(angle)])).round(1)
        head = f"UNITS MM ; VAR p : FRAME ; BEGIN p = WORLD * XYZ({x}, {y}, {z}) * ROTX(180) ; PAUSE 0.3 ;"
        free = run(Source("free.rlo", f"{head} MOVE ARM_1 TO p ; END."), cell_with(tmp_path, belt))
        cell = cell_with(tmp_path, belt + ball)
        distance = least_distance(cell, free.stages[-1].stage.trajectory, 0.3)
        past = run(Source("past.rlo", f"{head} TRY MOVE ARM_1 TO p ; RECOVER PAUSE 0 END END."), cell)
        refused = not past.stages
        assert refused or distance > -1e-3
        assert not refused or distance < 2e-3
        met += refused
    sample.record("MOVEs past a ball on a belt", sample.count(100), 0, met=met)


def shown(recording: Recording, name: str, t: Array) -> Array:
    """Where the page shows a part that no arm holds."""
    return next(part_poses(part, t, {}) for part in moved_parts(recording, ShapeTable()) if part.name == name)


def test_page_shows_parts_on_a_belt(tmp_path: Path) -> None:
    """A part is drawn where the belt has come to, within 0.1 mm, while that changes its speed too."""
    cell = cell_with(tmp_path, BELT.format(speed=100, later=-300) + BALL.format(x=0.2, y=0.05))
    recording = run(Source("wait.rlo", "BEGIN PAUSE 1.5 END."), cell)
    t = np.arange(0, 1.5, 0.013)

    frame = cell.moving_frames["BELT"]
    expected = np.stack([(frame.pose_at(time) @ np.array([0.2, 0.05, 0.0, 1.0]))[:3] for time in t])
    np.testing.assert_allclose(shown(recording, "BALL", t)[:, :3, 3], expected, rtol=0, atol=1e-4)


def test_parts_on_frames_that_stand(tmp_path: Path) -> None:
    """A part goes with frames that move; others are named, with what there is."""
    text = BELT.format(speed=1, later=1) + BALL.format(x=0, y=0).replace('"BELT"', '"BETL"')
    with pytest.raises(FileFormatError, match=r"BETL is not a frame that moves by itself.*BELT"):
        cell_with(tmp_path, text)


def test_worlds_with_physics(tmp_path: Path) -> None:
    """They have no belts, and say so."""
    cell = cell_with(tmp_path, BELT.format(speed=1, later=1) + BALL.format(x=0, y=0))
    with pytest.raises(InvalidValueError, match="part BALL lies on BELT, which moves by itself"):
        PhysicsCell(cell)


def test_a_camera_over_a_belt(tmp_path: Path) -> None:
    """A part that is read is where it is when the reading ends, so a frame goes with it from then on."""
    sight = '[visions]\nBALL = { part = "BALL" }\n[camera]\ntime_s = 0.25\n'
    cell = cell_with(tmp_path, BELT.format(speed=120, later=60) + BALL.format(x=0.1, y=0.03) + sight)
    read = "READ VISIONS (ball) ; AFFIX ball TO belt ; PAUSE 1 ; PRINT(Y(ball) - Y(belt), X(ball) - X(belt))"
    recording = run(Source("t.rlo", f"UNITS MM ; VAR ball, belt : FRAME ; BEGIN {read} END."), cell)

    assert printed(recording) == ["100 -30"]


def test_advice_about_what_a_belt_carries(tmp_path: Path) -> None:
    """What is hit is a part, and no arm to wait for; the time is that of the run."""
    cell = cell_with(tmp_path, BELT.format(speed=200, later=200) + BALL.format(x=0, y=0.05))
    text = "UNITS MM ; BEGIN PAUSE 0.5 ; MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 40) WITH DURATION = 4 END."
    error = failure(text, cell)

    assert "would hit BALL" in error.diagnostic.message
    assert not any("WAIT for an EVENT" in line for line in error.diagnostic.helps)
    assert any(float(note.split(", at ")[1].removesuffix(" s")) > 0.5 for note in error.diagnostic.notes)
