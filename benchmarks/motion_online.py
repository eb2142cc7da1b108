"""A new goal in mid-motion beside Ruckig's own step, and the fastest run along a path beside toppra's."""

from measure import in_turn, microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import ruckig
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.motion.joint_path import through_knots
from armwright.motion.online import JERK_TIME, retarget
from armwright.motion.time_optimal_path import time_optimal
from armwright.motion.trajectory import Trajectory

ARM = load_arm("puma560")
SPEED, ACCELERATION = ARM.limits.speed, ARM.limits.acceleration


def new_goal() -> list[list[str]]:
    """Return the rows on a new goal: the plan alone, and the plan with 1000 samples of it."""
    progress("a new goal")
    rng = np.random.default_rng(0)
    q, goal = rng.uniform(-1, 1, (2, 6))
    qd, qdd = SPEED / 4, ACCELERATION / 4
    request, theirs, generator = ruckig.InputParameter(6), ruckig.Trajectory(6), ruckig.Ruckig(6)
    request.max_velocity, request.max_acceleration = SPEED.tolist(), ACCELERATION.tolist()
    request.max_jerk = (ACCELERATION / JERK_TIME).tolist()

    def plan() -> None:
        request.current_position, request.current_velocity = q.tolist(), qd.tolist()
        request.current_acceleration, request.target_position = qdd.tolist(), goal.tolist()
        generator.calculate(request, theirs)

    ticks = np.linspace(0, retarget(ARM, q, qd, qdd, goal).duration, 1000)

    def sampled_by_ruckig() -> None:
        plan()
        for t in ticks:
            theirs.at_time(t)

    def sampled() -> None:
        move = retarget(ARM, q, qd, qdd, goal)
        for order in range(3):
            move(ticks, order)

    rows = []
    for work, peer_work, own_work, calls in (
        ("plan", plan, lambda: retarget(ARM, q, qd, qdd, goal), 2000),
        ("plan and 1000 samples", sampled_by_ruckig, sampled, 100),
    ):
        peer, own = per_call(peer_work, own_work, calls=calls)
        rows.append([work, microseconds(peer), microseconds(own), f"{peer / own:.2f}"])
    return rows


class Adapted:
    """A path as toppra wants it."""

    def __init__(self, path: Trajectory) -> None:
        """Take the path."""
        self.path, self.path_interval, self.dof = path, np.array([0.0, path.duration]), 6

    def __call__(self, s: Array, order: int = 0) -> Array:
        """Return positions or derivatives at parameters."""
        return self.path(s, order)


def fastest_run() -> list[list[str]]:
    """Return the rows on a path through five knots: toppra on speeds and accelerations, ours also on efforts."""
    progress("the fastest run")
    knots = np.random.default_rng(83008).uniform(-0.8, 0.8, (5, 6))
    path = through_knots(ARM, knots)
    bounds = [
        JointVelocityConstraint(np.stack([-SPEED, SPEED], axis=1)),
        JointAccelerationConstraint(np.stack([-ACCELERATION, ACCELERATION], axis=1)),
    ]
    rows = []
    for intervals in (100, 300, 1000):
        s = np.linspace(0, path.duration, intervals + 1)
        found = {}

        def theirs(s: Array = s, found: dict[str, float] = found) -> None:
            run = TOPPRA(bounds, Adapted(path), s, solver_wrapper="seidel")
            _, sd, _ = run.compute_parameterization(0, 0)
            found["toppra"] = float((2 * np.diff(s) / (sd[1:] + sd[:-1])).sum())

        def ours(intervals: int = intervals, found: dict[str, float] = found) -> None:
            found["armwright"] = time_optimal(ARM, knots, efforts=False, intervals=intervals).trajectory.duration

        def with_efforts(intervals: int = intervals) -> None:
            time_optimal(ARM, knots, intervals=intervals)

        peer, own, efforts = in_turn(theirs, ours, with_efforts, repeats=3)
        durations = [f"{found[name]:.3f}" for name in ("toppra", "armwright")]
        rows.append([str(intervals), *durations, *(f"{taken * 1e3:.0f}" for taken in (peer, own, efforts))])
    return rows


if __name__ == "__main__":
    section(
        "A new goal in mid-motion",
        "Six joints of `puma560`, synchronised. Ruckig plans in both; on our side its phases are checked against the "
        "range of the joints and become a trajectory that can be joined, checked and changed again.",
        table(["work", "Ruckig, µs", "armwright, µs", "ratio"], new_goal()),
    )
    section(
        "The fastest run along a path",
        "Five knots of `puma560`, limits of speed and acceleration, and on our side of effort too. Toppra keeps the "
        "limits at its grid points; ours holds between them as well, checked exactly, which is most of its time.",
        table(
            ["intervals", "run by toppra, s", "run by armwright, s", "toppra, ms", "armwright, ms", "with efforts, ms"],
            fastest_run(),
        ),
    )
