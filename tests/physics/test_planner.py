"""Paths past bodies: by another library, against another search, with the causes where there is none."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import InvalidValueError
from armwright.motion.efforts import effort_peaks
from armwright.motion.quintic_polynomials import TOP_SPEED
from armwright.physics.cell_bodies import Body
from armwright.physics.planner import PlannedPath, PlanningError, plan_path
from armwright.spatial.shapes import Box, Solid, Sphere
from physics.cluttered import (
    ARM,
    Coal,
    Task,
    checker_of,
    configurations,
    is_free,
    random_task,
    solutions,
    solved_by_ompl,
)
from samples import Sample

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

ARMS = ("stanford", "puma560", "ur5")
# Of so many checked configurations a search of OMPL may use ten times as many.
CHECKS = 20_000
ROUNDING = 1e-9
# Gaps that the first link stands in, and no other gets through.
GAPS = {"stanford": (0.17, 0.62), "puma560": (0.12, 0.1), "ur5": (0.12, 0.19)}


def planned(task: Task, **options: float) -> PlannedPath:
    return plan_path(task.checker, ARM, task.start, task.goals, **options)


@pytest.mark.drawn(0.34)
@pytest.mark.proof
@pytest.mark.parametrize("name", ARMS)
def test_cluttered_cells(name: str, sample: Sample) -> None:
    """No path collides, as coal finds at many configurations; and nearly all are found that a longer search finds."""
    # Some cells have no path: the small sample goes on until there are some.
    cells, enough, looks = (100, 100, 10_000) if sample.whole else (40, 2, 1000)
    collides = missed = solvable = solved = 0
    for k in range(cells):
        task = random_task(name, np.random.default_rng([sample.seed, k]))
        try:
            path = planned(task, checks=CHECKS)
        except PlanningError as error:
            # The longer search takes its time.
            missed += error.cause != "not found"
            missed += sample.whole and solved_by_ompl(task, 10 * CHECKS, k)
            continue
        solved += 1
        motion = path.trajectory
        np.testing.assert_array_equal(motion(0.0), task.start)
        np.testing.assert_allclose(motion(motion.duration), task.goals[path.goal], rtol=0, atol=1e-9)
        collides += any(Coal(task.checker).collides(motion(np.linspace(0.0, motion.duration, looks))))
        if solved == enough:
            break
    solvable = solved + missed
    sample.record(f"paths in cluttered cells, {name}: collide", solved, collides)
    sample.record(f"paths in cluttered cells, {name}: not found, but by ten times the checks", solvable, missed)
    assert solved
    assert collides == 0
    assert missed <= 0.02 * solvable


@pytest.mark.share(0.05)
@pytest.mark.proof
def test_within_limits(sample: Sample) -> None:
    """A planned motion rests at its ends, keeps speeds, accelerations and efforts, and takes as long as asked for."""
    for rng in sample.cases(20):
        task = random_task(ARMS[rng.integers(3)], rng)
        speed = float(rng.uniform(20, TOP_SPEED))
        try:
            path = planned(task, speed=speed, period=0.004)
        except PlanningError:
            continue
        motion, arm = path.trajectory, task.checker.arms[ARM].arm.arm
        part = speed / TOP_SPEED
        assert (motion.peaks(1) <= part * arm.limits.speed * (1 + ROUNDING)).all()
        assert (motion.peaks(2) <= part**2 * arm.limits.acceleration * (1 + ROUNDING)).all()
        assert (effort_peaks(arm, motion).peaks <= arm.limits.effort * (1 + 1e-6)).all()
        np.testing.assert_allclose(motion(np.array([0.0, motion.duration]), 1), 0.0, atol=1e-9)
        assert abs(motion.duration / 0.004 - round(motion.duration / 0.004)) < 1e-6
        inner = np.linspace(0.0, motion.duration, 4001)
        np.testing.assert_allclose(np.diff(motion(inner, 1), axis=0), 0.0, atol=1.01 * inner[1] * motion.peaks(2).max())


def bits(path: PlannedPath) -> str:
    return path.trajectory.coefficients.tobytes().hex() + path.waypoints.tobytes().hex() + str(path.checked)


def test_the_same_bits(sample: Sample) -> None:
    """A second plan, one after a plan with another seed, and one in another process, all have the same bits."""
    seed = int(sample.seed)
    task = random_task("stanford", np.random.default_rng(seed))
    while True:
        try:
            first = planned(task, seed=seed)
            break
        except PlanningError:
            seed += 1
            task = random_task("stanford", np.random.default_rng(seed))
    program = (
        "import numpy as np; from physics.cluttered import random_task\n"
        "from physics.test_planner import bits, planned\n"
        f"print(bits(planned(random_task('stanford', np.random.default_rng({seed})), seed={seed})))"
    )
    tests = Path(__file__).parents[1]
    there = subprocess.run([sys.executable, "-c", program], cwd=tests, capture_output=True, text=True, check=True)

    other = planned(task, seed=seed + 1)

    assert bits(planned(task, seed=seed)) == bits(first)
    assert there.stdout.strip() == bits(first)
    assert there.stderr == ""
    assert other.seed == seed + 1


def free_task(rng: np.random.Generator, name: str) -> Task:
    """A start and a goal without any bodies."""
    checker = checker_of(name, [])
    start, goal = configurations(checker, rng, 2)
    goals = solutions(checker, goal, start)
    return Task(checker, start, goals) if len(goals) else free_task(rng, name)


def links_at(task: Task, q: np.ndarray) -> np.ndarray:
    frames = task.checker.arms[ARM].arm.link_poses(q[None])[0]
    return np.array([(frames[body.link] @ body.solid.pose)[:3, 3] for body in task.checker.bodies if body.arm])


def ball(name: str, centre: np.ndarray, radius: float) -> Body:
    X = np.eye(4)
    X[:3, 3] = centre
    return Body(name, Solid(shape=Sphere(radius=radius), pose=X))


@pytest.mark.proof
@pytest.mark.parametrize("name", ARMS)
def test_causes(name: str, sample: Sample) -> None:
    """A body on the start, and one on all solutions of the goal, are told apart, with names and by how much."""
    told = {"start": 0, "goal": 0}
    for rng in sample.cases(20):
        while True:
            task = free_task(rng, name)
            here, there = links_at(task, task.start)[-1], links_at(task, task.goals[0])[-1]
            if np.linalg.norm(links_at(task, task.start) - there, axis=1).min() > 0.4:
                break
        for cause, place in (("start", here), ("goal", there)):
            checker = checker_of(name, [ball("BALL", place, 0.05)])
            with pytest.raises(PlanningError) as raised:
                plan_path(checker, ARM, task.start, task.goals, checks=2000)
            error = raised.value
            assert error.cause == cause
            assert "overlaps BALL by" in str(error)
            assert {overlap.bodies[1] for overlap in error.overlaps} == {"BALL"}
            told[cause] += 1
    assert told["start"] == told["goal"] == sample.count(20)
    sample.record(f"bodies on start and goal, {name}", sum(told.values()), 0)


@pytest.mark.proof
@pytest.mark.parametrize("name", ARMS)
def test_closed_wall(name: str, sample: Sample) -> None:
    """Where a wall through the axis of the base parts start and goal, no path is found, and that is what is said."""
    for rng in sample.cases(20):
        checker = checker_of(name, plates(*GAPS[name]))
        while True:
            start, goal = configurations(checker, rng, 2)
            if not (is_free(checker, start) and is_free(checker, goal)):
                continue
            goals = solutions(checker, goal, start)
            sides = [np.sign(links_at(Task(checker, start, goals), q)[:, 1]) for q in (start, goal)]
            if len(goals) and (sides[0][-2:] > 0).all() and (sides[1][-2:] < 0).all():
                break
        with pytest.raises(PlanningError, match="no path was found within") as raised:
            plan_path(checker, ARM, start, goals, checks=3000)
        assert raised.value.cause == "not found"
        assert raised.value.checked <= 1.3 * 3000 + len(goals)
    sample.record(f"closed walls, {name}", sample.count(20), 0)


def plates(foot: float, top: float) -> list[Body]:
    """A wall in the plane of the axis of the base, with a gap about the foot, so wide to either side and so high."""
    standing = []
    for side in (-1, 1):
        X = np.eye(4)
        X[0, 3] = side * (foot + 1.5)
        standing.append(Body("WALL", Solid(shape=Box(size=(3.0, 0.02, 8.0)), pose=X)))
    X = np.eye(4)
    X[2, 3] = top + 2.0
    return [*standing, Body("WALL", Solid(shape=Box(size=(2 * foot, 0.02, 4.0)), pose=X))]


def test_what_is_refused() -> None:
    """Goals that are none, and budgets and seeds out of range."""
    task = free_task(np.random.default_rng(1), "ur5")
    with pytest.raises(InvalidValueError, match="checks"):
        planned(task, checks=0)
    with pytest.raises(InvalidValueError, match="seed"):
        planned(task, seed=-1)
    with pytest.raises(ValueError, match=r"goals: expected one or more of 6 joint positions, got shape \(0, 6\)"):
        plan_path(task.checker, ARM, task.start, np.zeros((0, 6)))
