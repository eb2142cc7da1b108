"""One way to ask every library for the configurations of a pose, and the proof that its model is ours."""

import functools
from typing import Protocol

import attrs
import numpy as np
from eaik.IK_DH import DhRobot
from roboticstoolbox import DHRobot, PrismaticDH, RevoluteDH
from roboticstoolbox.models.DH import Puma560

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse

# Two models that put the hand this near to each other at random configurations are one [m] and entries of a rotation.
_SAME_MODEL = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class Reply:
    """What a library answers for one pose.

    Attributes:
        rows: (k, 6) the configurations that it returns.
        claimed: (k,) whether it says that they meet the pose.
        reached: whether it says that the pose can be reached; None where it looks inside the limits only.
        inside: whether it says that a configuration is inside the limits; None where it knows no limits.
        errors: (k, 2) the residuals that it reports [m] and [rad]; None where it reports none for each row.
    """

    rows: Array
    claimed: Array
    reached: bool | None
    inside: bool | None = None
    errors: Array | None = None


class Solver(Protocol):
    """A library, set up for one arm."""

    one: bool  # whether it gives one configuration only

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:
        """Ask for a pose; ``arm`` has the limits of the set, ``near`` where to start from."""


class Armwright:
    """``armwright.inverse``."""

    one = False

    def __init__(self, name: str) -> None:
        self.arm = load_arm(name)

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""
        return forward(self.arm, q)

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:
        """Ask for a pose."""
        solution = inverse(arm, X, near)
        reached = solution.outcome is not Outcome.OUT_OF_REACH
        return Reply(
            rows=np.array([branch.q for branch in solution]),
            claimed=np.full(len(solution.branches), reached),
            reached=reached,
            inside=solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR),
            errors=np.array([(branch.position_error, branch.rotation_error) for branch in solution]),
        )


class Eaik:
    """EAIK from the Denavit-Hartenberg numbers: rows, and which of them are least-squares approximations."""

    one = False

    def __init__(self, name: str) -> None:
        joints = load_arm(name).joints
        if any(not joint.revolute or joint.theta for joint in joints):
            raise NotImplementedError("no slides")
        self.robot = DhRobot(*(np.array([getattr(joint, key) for joint in joints]) for key in ("alpha", "a", "d")))

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""
        return self.robot.fwdKin(q)

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:  # noqa: ARG002
        """Ask for a pose."""
        found = self.robot.IK(X)
        rows = np.array(found.Q).reshape(-1, 6)
        claimed = ~np.array(found.is_LS, dtype=bool)
        return Reply(rows=rows, claimed=claimed, reached=bool(claimed.any()))


@functools.cache
def _toolbox(name: str) -> DHRobot:
    """Return the arm in the Robotics Toolbox, of the same Denavit-Hartenberg numbers."""
    links = [
        RevoluteDH(d=joint.d, a=joint.a, alpha=joint.alpha, offset=joint.theta)
        if joint.revolute
        else PrismaticDH(theta=joint.theta, a=joint.a, alpha=joint.alpha, offset=joint.d)
        for joint in load_arm(name).joints
    ]
    return DHRobot(links, name=name)


def _limit(robot: DHRobot, arm: Arm) -> None:
    for link, joint in zip(robot.links, arm.joints, strict=True):
        link.qlim = [joint.limits.lower, joint.limits.upper]


class ToolboxAnalytic:
    """``analytic_ik()`` of the Robotics Toolbox: all configurations, and whether any is inside the limits."""

    one = False

    def __init__(self, name: str) -> None:
        self.robot = _toolbox(name)
        self.solver = self.robot.analytic_ik()

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""
        return self.robot.fkine(q).A

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:
        """Ask for a pose."""
        _limit(self.robot, arm)
        inside = self.solver.solve(X)
        everything = self.solver.solve(X, joint_limits=False)
        rows = np.asarray(everything.q).reshape(-1, 6)
        if near is not None:
            # From a configuration it gives the nearest one, turned to it.
            nearest = self.solver.ikine(X, q0=near)
            rows = np.asarray(nearest.q).reshape(-1, 6) if nearest.success else rows[:0]
        return Reply(
            rows=rows,
            claimed=np.ones(len(rows), dtype=bool),
            reached=bool(everything.success),
            inside=bool(inside.success),
        )


class ToolboxPuma:
    """``Puma560.ikine_a`` of the Robotics Toolbox, with our lengths, asked for all eight configurations."""

    one = False
    # Its x axes 1, 3, 4 and 5 point the other way: twists and lengths change their signs, and angles count from there.
    _shift = np.array((np.pi, -np.pi, np.pi, 0.0, 0.0, -np.pi))
    _configurations = tuple(a + b + c for a in "lr" for b in "ud" for c in "nf")

    def __init__(self, name: str) -> None:
        if name != "puma560":
            raise NotImplementedError("PUMA only")
        self.robot = Puma560()
        upper, fore = load_arm(name).joints[1:3]
        self.robot.links[0].d, self.robot.links[1].a = 0.0, upper.a
        self.robot.links[2].a, self.robot.links[2].d = -fore.a, fore.d
        self.robot.links[3].d = load_arm(name).joints[3].d

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""
        return self.robot.fkine(q + self._shift).A

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:  # noqa: ARG002
        """Ask for a pose."""
        found = [self.robot.ikine_a(X, configuration) for configuration in self._configurations]
        rows = np.array([one.q - self._shift for one in found if np.isfinite(one.q).all()]).reshape(-1, 6)
        claimed = np.array([one.success for one in found if np.isfinite(one.q).all()], dtype=bool)
        return Reply(rows=rows, claimed=claimed, reached=bool(claimed.any()))


class ToolboxNumeric:
    """``ikine_LM`` of the Robotics Toolbox, with a tolerance fine enough for 1e-6 m; one solution inside the limits."""

    one = True

    def __init__(self, name: str) -> None:
        self.robot = _toolbox(name)

    def model(self, q: Array) -> Array:
        """Return its own forward pose of a configuration, (4, 4)."""
        return self.robot.fkine(q).A

    def solve(self, arm: Arm, X: Array, near: Array | None) -> Reply:
        """Ask for a pose."""
        _limit(self.robot, arm)
        # Its residual is half the square of the error.
        found = self.robot.ikine_LM(X, q0=near, tol=1e-13, seed=0)
        rows = np.asarray(found.q).reshape(-1, 6) if found.success else np.empty((0, 6))
        return Reply(
            rows=rows,
            claimed=np.ones(len(rows), dtype=bool),
            reached=None,
            inside=bool(found.success),
        )


SOLVERS: dict[str, type] = {
    "armwright": Armwright,
    "EAIK": Eaik,
    "roboticstoolbox `analytic_ik`": ToolboxAnalytic,
    "roboticstoolbox `ikine_a`": ToolboxPuma,
    "roboticstoolbox `ikine_LM`": ToolboxNumeric,
}


def solvers(name: str) -> dict[str, Solver]:
    """Return those of the libraries that can solve an arm, each proven to mean the same arm."""
    arm = load_arm(name)
    found: dict[str, Solver] = {}
    for title, build in SOLVERS.items():
        try:
            solver = build(name)
        except NotImplementedError:
            continue
        for q in np.random.default_rng(0).uniform(-1.5, 1.5, size=(100, arm.n)):
            np.testing.assert_allclose(solver.model(q), forward(arm, q), atol=_SAME_MODEL, err_msg=title)
        found[title] = solver
    return found
