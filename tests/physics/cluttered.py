"""Random cells full of bodies, and another library that says whether an arm meets them."""

from itertools import pairwise
from typing import Any, NamedTuple

import coal
import numpy as np

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import nearest_configurations
from armwright.motion.quintic_polynomials import point_to_point
from armwright.physics.cell_bodies import Body, arm_bodies
from armwright.physics.clearance import RESOLUTION, ClearanceChecker, PlacedArm
from armwright.physics.configuration_checks import ConfigurationChecks
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.spatial.shapes import Box, Capsule, Cylinder, Shape, Solid, Sphere
from oracles.solids import coal_pose, coal_shape

ARM = "ARM_1"


class Task(NamedTuple):
    """An arm among bodies, where it stands, and the IK solutions of where it is to go."""

    checker: ClearanceChecker
    start: Array
    goals: Array


def checker_of(name: str, standing: list[Body]) -> ClearanceChecker:
    arm = load_arm(name)
    # The base stands.
    moving = [body for body in arm_bodies(ARM, arm) if body.link]
    pairs = [(i, len(moving) + j) for i in range(len(moving)) for j in range(len(standing))]
    placed = PlacedArm(compile_arm(arm, quickly=True), np.eye(4))
    return ClearanceChecker({ARM: placed}, [*moving, *standing], pairs)


def random_shape(rng: np.random.Generator) -> Shape:
    kinds: list[Shape] = [
        Box(size=rng.uniform(0.05, 0.5, 3)),
        Cylinder(radius=rng.uniform(0.03, 0.15), length=rng.uniform(0.1, 0.8)),
        Capsule(radius=rng.uniform(0.03, 0.1), length=rng.uniform(0.1, 0.8)),
        Sphere(radius=rng.uniform(0.05, 0.2)),
    ]
    return kinds[rng.integers(len(kinds))]


def configurations(checker: ClearanceChecker, rng: np.random.Generator, count: int) -> Array:
    limits = checker.arms[ARM].arm.arm.limits
    return rng.uniform(np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi), (count, len(limits.lower)))


def is_free(checker: ClearanceChecker, q: Array) -> bool:
    return bool((ConfigurationChecks(checker).distances_of({ARM: q}, 1.0) > 2 * RESOLUTION).all())


def solutions(checker: ClearanceChecker, q: Array, start: Array) -> Array:
    arm = checker.arms[ARM].arm.arm
    return np.array(nearest_configurations(inverse(arm, forward(arm, q), start), start))


def random_task(name: str, rng: np.random.Generator) -> Task:
    """A cell in which the start is free, the solutions of the goal are too, and the motion to the first one collides.

    In half of the cells there is one solution only, so that no other is reached on a straight way.
    """
    reach = load_arm(name).reach
    while True:
        standing = []
        for k in range(int(rng.integers(8, 17))):
            direction = rng.normal(size=3)
            X = homogeneous(
                rotation_from_vector(rng.normal(size=3)),
                direction / np.linalg.norm(direction) * reach * rng.uniform(0.35, 1.1),
            )
            standing.append(Body(f"body {k}", Solid(shape=random_shape(rng), pose=X)))
        checker = checker_of(name, standing)
        free = [q for q in configurations(checker, rng, 20) if is_free(checker, q)]
        for start, goal in zip(free[::2], free[1::2], strict=False):
            goals = np.array([q for q in solutions(checker, goal, start)[:16] if is_free(checker, q)])
            if not len(goals):
                continue
            if rng.random() < 0.5:
                goals = goals[:1]
            direct = point_to_point(checker.arms[ARM].arm.arm, start, goals[0])
            if checker.first_contact({ARM: direct}) is not None:
                return Task(checker, start, goals)


class Coal:
    """An arm among bodies, by coal."""

    def __init__(self, checker: ClearanceChecker) -> None:
        self.checker = checker
        self.moving = [body for body in checker.bodies if body.arm]
        standing = [body for body in checker.bodies if body.arm is None]
        self.standing = [coal.CollisionObject(coal_shape(b.solid.shape), coal_pose(b.solid.pose)) for b in standing]
        self.shapes = [coal_shape(body.solid.shape) for body in self.moving]
        self.tree = coal.DynamicAABBTreeCollisionManager()
        for body in self.standing:
            self.tree.registerObject(body)
        self.tree.setup()

    def collides(self, q: Array) -> list[bool]:
        """Whether the arm collides at configurations (k, n)."""
        placed = self.checker.arms[ARM]
        frames = placed.base @ placed.arm.link_poses(q)
        results = []
        for X in frames:
            hit = False
            for body, shape in zip(self.moving, self.shapes, strict=True):
                answer = coal.CollisionCallBackDefault()
                self.tree.collide(coal.CollisionObject(shape, coal_pose(X[body.link] @ body.solid.pose)), answer)
                hit = hit or answer.data.result.isCollision()
            results.append(hit)
        return results


def solved_by_ompl(task: Task, checks: int, seed: int) -> bool:
    """Whether OMPL's RRT-Connect, as it comes, finds a path among configurations that coal checks, so many at most.

    Legs are checked every 20 mrad or 20 mm.
    """
    from ompl import base, geometric, util

    arm, oracle, checked = task.checker.arms[ARM].arm.arm, Coal(task.checker), 0
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(seed + 1)
    space, bounds = base.RealVectorStateSpace(arm.n), base.RealVectorBounds(arm.n)
    for i in range(arm.n):
        bounds.setLow(i, float(arm.limits.lower[i]))
        bounds.setHigh(i, float(arm.limits.upper[i]))
    space.setBounds(bounds)
    information = base.SpaceInformation(space)

    def valid(state: Any) -> bool:
        nonlocal checked
        checked += 1
        return not oracle.collides(np.array([[state[i] for i in range(arm.n)]]))[0]

    def state_of(q: Array) -> Any:
        state = space.allocState()
        for i, x in enumerate(q.tolist()):
            state[i] = x
        return state

    information.setStateValidityChecker(valid)
    information.setStateValidityCheckingResolution(0.02 / space.getMaximumExtent())
    information.setup()
    problem, goals = base.ProblemDefinition(information), base.GoalStates(information)
    problem.addStartState(state_of(task.start))
    for q in task.goals:
        goals.addState(state_of(q))
    problem.setGoal(goals)
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(lambda: checked >= checks))
    if not problem.hasExactSolution():
        return False
    corners = np.array([[state[i] for i in range(arm.n)] for state in problem.getSolutionPath().getStates()])
    # A path that touches a body between the positions that were checked solves nothing.
    legs = [np.linspace(a, b, max(2, int(np.abs(b - a).max() / 5e-4))) for a, b in pairwise(corners)]
    return not any(oracle.collides(np.concatenate(legs)))
