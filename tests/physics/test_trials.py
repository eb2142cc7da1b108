"""What is drawn for trials, and the verdict on worlds that are set up to fail or succeed."""

import json
import re

import attrs
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.errors import InvalidValueError
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.trajectory import Trajectory
from armwright.physics.trials import draw_case, goal_pose, judge, placing_error
from armwright.physics.world import PhysicsCell
from armwright.program.vm.trials import cell_hashes
from armwright.spatial.poses import homogeneous, inverse as inverse_pose
from armwright.spatial.shapes import Mesh
from oracles.benches import bench_text, flat_pose

TRIALS = """[trials]
friction = [0.4, 1.0]
mass_pct = 20
pose = { BLOCK = { xy_mm = 20, yaw_deg = 180 }, SLOT = { xy_mm = 15, yaw_deg = 10 } }
goal = { BLOCK = { at = "SLOT", mm = 2, deg = 3 } }
noise = { pixels = [1, 3], force_N = [0.1, 0.5], effort_pct = [0, 1] }
"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    """A bench with trials."""
    path = tmp_path_factory.mktemp("bench") / "bench.toml"
    path.write_text(bench_text() + TRIALS, encoding="utf-8")
    return read_cell(path)


def _drawn(cell: Cell, seed: int, number: int) -> list[float]:
    case = draw_case(cell, seed, number)
    part, arm = case.parts["BLOCK"], case.cell.arms["ARM_1"]
    return [
        *part.pose.ravel(),
        part.friction,
        part.mass,
        *case.cell.markers["SLOT"].pose.ravel(),
        case.cell.cameras["CAMERA"].noise,
        arm.force_sensor.noise,
        arm.sensors.effort_noise,
        case.seed,
    ]


def test_a_trial_is_the_same_alone_and_another_with_another_number_or_seed(cell: Cell) -> None:
    assert _drawn(cell, 1, 17) == _drawn(cell, 1, 17)
    assert len({tuple(_drawn(cell, seed, number)) for seed in (0, 1) for number in (1, 2, 3)}) == 6


def test_what_is_drawn_fills_its_bounds(cell: Cell) -> None:
    cases = [draw_case(cell, 3, number) for number in range(1, 101)]
    parts = [case.parts["BLOCK"] for case in cases]
    nominal, slot = cell.parts["BLOCK"], cell.markers["SLOT"]
    offsets = np.array([part.pose[:2, 3] - nominal.pose[:2, 3] for part in parts])
    yaws = np.array([np.arctan2(part.pose[1, 0], part.pose[0, 0]) for part in parts])
    moved = np.array([case.cell.markers["SLOT"].pose[:2, 3] - slot.pose[:2, 3] for case in cases])
    drawn = {
        "x": (offsets[:, 0], -0.02, 0.02),
        "y": (offsets[:, 1], -0.02, 0.02),
        "yaw": (yaws, -np.pi, np.pi),
        "marker": (moved[:, 0], -0.015, 0.015),
        "friction": (np.array([part.friction for part in parts]), 0.4, 1.0),
        "mass": (np.array([part.mass for part in parts]), 0.16, 0.24),
        "pixels": (np.array([case.cell.cameras["CAMERA"].noise for case in cases]), 1.0, 3.0),
        "force": (np.array([case.cell.arms["ARM_1"].force_sensor.noise for case in cases]), 0.1, 0.5),
        "effort": (np.array([case.cell.arms["ARM_1"].sensors.effort_noise for case in cases]), 0.0, 0.01),
    }
    for name, (values, low, high) in drawn.items():
        width = high - low
        assert low <= values.min() <= low + 0.1 * width, name
        assert high - 0.1 * width <= values.max() <= high, name
    assert all(part.pose[2, 3] == nominal.pose[2, 3] for part in parts)


def test_parts_are_drawn_anew_where_they_would_stand_inside_others(cell: Cell) -> None:
    other = attrs.evolve(cell.parts["BLOCK"], name="OTHER", marker=None)
    crowded = attrs.evolve(cell, parts={"BLOCK": cell.parts["BLOCK"], "OTHER": other})
    # Both stand at the same place but for 20 mm either way, and are 40 mm wide: few draws, or none, keep them apart.
    wide = attrs.evolve(cell.trials.poses["BLOCK"], position=0.06)
    spread = attrs.evolve(crowded, trials=attrs.evolve(cell.trials, poses={"BLOCK": wide}))
    for number in range(1, 6):
        parts = draw_case(spread, 1, number).parts
        assert np.abs(parts["BLOCK"].pose[:2, 3] - parts["OTHER"].pose[:2, 3]).max() > 0.02
    tight = attrs.evolve(crowded, trials=attrs.evolve(cell.trials, poses={}))
    with pytest.raises(InvalidValueError, match=r"trial 1: in 100 draws .* BLOCK and OTHER"):
        draw_case(tight, 1, 1)


def test_trials_of_another_cell_are_others(cell: Cell) -> None:
    """What a trial depends on is part of what finished trials are stored for: meshes and both models of an arm too."""
    arm, block = cell.arms["ARM_1"], cell.parts["BLOCK"]
    corners = np.array([(0, 0, 0), (0.04, 0, 0), (0, 0.04, 0), (0, 0, 0.04)])
    mesh = Mesh(vertices=corners, faces=np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]))
    bent = attrs.evolve(mesh, vertices=mesh.vertices * (1 + 1e-15))
    heavier = attrs.evolve(arm.arm, links=[attrs.evolve(link, mass=(link.mass or 0) + 1e-9) for link in arm.arm.links])
    others = {
        "the cell": cell,
        "another model": attrs.evolve(cell, arms={"ARM_1": attrs.evolve(arm, arm=heavier, plant=arm.arm)}),
        "another plant": attrs.evolve(cell, arms={"ARM_1": attrs.evolve(arm, plant=heavier)}),
        "a mesh": attrs.evolve(cell, parts={"BLOCK": attrs.evolve(block, shape=mesh)}),
        "another mesh": attrs.evolve(cell, parts={"BLOCK": attrs.evolve(block, shape=bent)}),
        "a piece": attrs.evolve(cell, parts={"BLOCK": attrs.evolve(block, shape=attrs.evolve(mesh, pieces=[mesh]))}),
        "a goal": attrs.evolve(cell, trials=attrs.evolve(cell.trials, goals={})),
        "a period": attrs.evolve(cell, period=2e-3),
    }

    assert cell_hashes(attrs.evolve(cell)) == cell_hashes(cell)
    assert len({json.dumps(cell_hashes(other)) for other in others.values()}) == len(others)


def _world(cell: Cell, X: np.ndarray) -> PhysicsCell:
    parts = {"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=X)}
    return PhysicsCell(cell, parts=parts)


def _placed(cell: Cell, x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> PhysicsCell:
    goal = goal_pose(cell, "BLOCK")
    return _world(cell, flat_pose(*(goal[:3, 3] + (x, y, z)), yaw))


def test_a_part_stands_on_the_marker_of_its_goal(cell: Cell) -> None:
    slot = cell.markers["SLOT"].pose
    assert np.allclose(goal_pose(cell, "BLOCK"), homogeneous(slot[:3, :3], slot[:3, 3] + (0, 0, 0.02)))


@pytest.mark.parametrize(
    ("x", "yaw", "cause"),
    [
        (0.0, 0.0, ""),
        (1.8e-3, 0.0, ""),
        (2.2e-3, 0.0, "misplaced"),
        (0.0, np.radians(2.9), ""),
        (0.0, np.radians(3.1), "misplaced"),
        # The block has a symmetry of four.
        (0.0, np.radians(90.0), ""),
        (0.0, np.radians(-92.9), ""),
        (0.0, np.radians(45.0), "misplaced"),
    ],
)
def test_a_part_at_rest_is_judged_by_its_distance_and_angle(cell: Cell, x: float, yaw: float, cause: str) -> None:
    verdict = judge(_placed(cell, x=x, yaw=yaw), cell, 0.0)
    assert verdict.cause == cause
    assert verdict.distance == pytest.approx(x, abs=2e-4)
    nearest = abs((yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    assert verdict.angle == pytest.approx(nearest, abs=2e-3)
    assert bool(verdict.message) == bool(cause)


def test_a_part_that_falls_into_place_is_waited_for(cell: Cell) -> None:
    assert judge(_placed(cell, z=0.01), cell, 0.0).cause == ""


def test_a_part_that_slides_is_moving(cell: Cell) -> None:
    goal = goal_pose(cell, "BLOCK")
    # Without friction it slides down the gravity that leans.
    smooth = attrs.evolve(
        cell,
        gravity=np.array([1.0, 0.0, -9.8]),
        fixtures={name: attrs.evolve(it, friction=0.0) for name, it in cell.fixtures.items()},
    )
    parts = {"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=goal, friction=0.0)}
    verdict = judge(PhysicsCell(smooth, parts=parts), smooth, 0.0)
    assert verdict.cause == "moving"
    assert verdict.message == "BLOCK still moves 1 s after the end"


def test_a_part_that_a_gripper_touches_is_not_let_go(cell: Cell) -> None:
    # Held in the air, at a goal that is there.
    tool = cell.tree().world("ARM_1")
    parts = {"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=homogeneous(np.eye(3), tool[:3, 3]))}
    aloft = attrs.evolve(
        cell,
        gravity=np.zeros(3),
        markers={"SLOT": attrs.evolve(cell.markers["SLOT"], pose=homogeneous(np.eye(3), tool[:3, 3] - (0, 0, 0.02)))},
    )
    world = PhysicsCell(aloft, parts=parts)
    seconds = world.move_fingers("ARM_1", 0.0, closed=True)
    assert world.advance(seconds + 0.1) is None
    verdict = judge(world, aloft, world.now)
    assert (verdict.cause, verdict.message) == ("not let go", "BLOCK is touched by ARM_1")
    world.move_fingers("ARM_1", world.now, closed=False)
    assert judge(world, aloft, world.now).cause in {"", "moving"}


def test_the_last_mishap_is_named_where_a_part_is_not_at_its_goal(cell: Cell) -> None:
    """A hand that has closed on nothing may be why a part is elsewhere; where the part is at its goal it is no news."""
    for x, words in (
        (0.02, r"from its goal at SLOT; 1 mishap before, the last R603 at 0.\d{3} s: ARM_1 closed"),
        (0, ""),
    ):
        world = _placed(cell, x=x)
        seconds = world.move_fingers("ARM_1", 0.0, closed=True, frame="BLOCK")
        mishap = world.advance(seconds + 0.1)
        assert mishap is not None
        assert mishap.code == "R603"
        verdict = judge(world, cell, world.now)
        assert verdict.cause == ("misplaced" if x else "")
        assert re.search(words, verdict.message)


def test_the_error_of_a_program_is_the_cause(cell: Cell) -> None:
    verdict = judge(_placed(cell), cell, 0.0, ("R603", "closed on nothing"))
    assert (verdict.cause, verdict.message) == ("R603", "closed on nothing")


def test_placing_errors_are_those_of_scipy(cell: Cell, rng: np.random.Generator) -> None:
    for symmetry in (1, 2, 4):
        part = attrs.evolve(cell.parts["BLOCK"], symmetry=symmetry)
        turned = Rotation.random(2, rng)
        positions = rng.normal(size=(2, 3))
        X, goal = (homogeneous(R.as_matrix(), p) for R, p in zip(turned, positions, strict=True))
        distance, angle = placing_error(X, goal, part)
        between = turned[0].inv() * turned[1]
        angles = [
            (between * Rotation.from_rotvec([0, 0, 2 * np.pi * k / symmetry])).magnitude() for k in range(symmetry)
        ]
        assert angle == pytest.approx(min(angles))
        assert distance == pytest.approx(np.linalg.norm(positions[0] - positions[1]))


def test_a_touch_is_a_cause_even_where_the_program_goes_on(cell: Cell) -> None:
    world, arm = _placed(cell), cell.arms["ARM_1"]
    # The arm is led straight down into the table.
    tool = np.array(cell.tree().world("ARM_1"))
    tool[2, 3] = 0.0
    low = inverse(arm.arm, inverse_pose(arm.base) @ tool).best.q
    down = Trajectory(times=np.array([0.0, 1.0]), coefficients=np.array([[arm.start, low - arm.start]]))
    world.start_motion("ARM_1", down, 0.0, np.eye(4))
    verdict = judge(world, cell, 1.0)
    assert verdict.cause == "R604"
    assert "TABLE" in verdict.message
    assert verdict.distance < 1e-3


@pytest.mark.parametrize(
    ("speed", "turn", "cause"),
    [(1.9e-3, 0.0, ""), (2.1e-3, 0.0, "moving"), (0.0, 0.049, ""), (0.0, 0.051, "moving"), (np.nan, 0.0, "moving")],
)
def test_a_part_at_rest_neither_moves_nor_turns(cell: Cell, speed: float, turn: float, cause: str) -> None:
    """Faster than 2 mm/s or 0.05 rad/s is no rest, and so is what is no number."""

    class Restless(PhysicsCell):
        def speed(self, part: str) -> tuple[float, float]:  # noqa: ARG002 - of any part
            return speed, turn

    parts = {"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=goal_pose(cell, "BLOCK"))}
    assert judge(Restless(cell, parts=parts), cell, 0.0).cause == cause
