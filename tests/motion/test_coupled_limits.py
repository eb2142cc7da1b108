"""Limits of coupled drives in motions: kept by every planner, and used up where they bind."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest

from armwright import compile_arm
from armwright.arm import Arm, Coupling, Limits, load_arm
from armwright.arrays import Array
from armwright.dynamics import inverse_dynamics
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.kinematics import forward
from armwright.motion import (
    OnlineError,
    PathError,
    effort_peaks,
    limit_use,
    point_to_point,
    retarget,
    slowing_for_efforts,
    straight_line,
    time_optimal,
)
from armwright.motion.limited import braked
from armwright.motion.trajectory import Trajectory
from samples import Sample

FREE = load_arm("puma560-seed")
START = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
GOAL = np.array([0.5, 0.4, 0.6, -0.3, 0.2, 0.4])
FRICTION = {"inertia": 5.0, "coulomb_forward": 1.0, "coulomb_backward": 2.0, "viscous": 3.0}
# So far may a limit be passed between samples.
SEEN = 2e-3


def with_drives(drive_3: Limits, drive_2: Limits | None = None, **motor: float) -> Arm:
    """The arm with an elbow that is driven from the base, as drives at the shoulder do by a parallelogram."""
    C = np.eye(6)
    C[2, 1] = -1.0
    limits = [Limits(), drive_2 or Limits(), drive_3, *[Limits()] * 3]
    motors = [attrs.evolve(each, **motor) for each in FREE.motors]
    return attrs.evolve(FREE, motors=motors, coupling=Coupling(matrix=C, limits=limits))


def without_gravity(arm: Arm) -> Arm:
    return attrs.evolve(arm, gravity=(0, 0, 0))


def elbow(trajectory: Trajectory, order: int) -> Array:
    """The position of drive 3, or a derivative of it, at many times."""
    values = trajectory(np.linspace(0.0, trajectory.duration, 4001), order)
    return values[:, 1] + values[:, 2]


def drive_effort(arm: Arm, trajectory: Trajectory) -> Array:
    """The effort of drive 2, which bears joint 2 less what drive 3 does there."""
    t = np.linspace(0.0, trajectory.duration, 4001)
    tau = inverse_dynamics(arm, *(trajectory(t, order) for order in range(3)))
    return tau[:, 1] - tau[:, 2]


def line(arm: Arm) -> Trajectory:
    X = forward(arm, START).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)
    return straight_line(arm, START, X).trajectory


PLANNERS: dict[str, Callable[[Arm], Trajectory]] = {
    "point to point": lambda arm: point_to_point(arm, START, START + GOAL, speed=120),
    "line": line,
    "compiled line": lambda arm: (
        straight_line(
            compile_arm(arm, quickly=True), START, forward(arm, START) @ translation(0.1, 0.1, -0.2)
        ).trajectory
    ),
    "time-optimal": lambda arm: time_optimal(arm, line(FREE)).trajectory,
}


def translation(*shift: float) -> Array:
    X = np.eye(4)
    X[:3, 3] = shift
    return X


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("order", [1, 2])
def test_speed_and_acceleration(name: str, order: int) -> None:
    """A drive that may do half of what a motion asks of it makes the motion slower, and is at its limit in it."""
    free = PLANNERS[name](FREE)
    most = float(np.abs(elbow(free, order)).max()) / 2
    limits = Limits(speed=most) if order == 1 else Limits(acceleration=most)

    motion = PLANNERS[name](with_drives(limits))

    used = float(np.abs(elbow(motion, order)).max()) / most
    assert motion.duration > 1.05 * free.duration
    assert 0.9 < used < 1 + SEEN
    use = limit_use(with_drives(limits), motion)["speed" if order == 1 else "acceleration"]
    assert use[2] == pytest.approx(used, abs=0.01)


@pytest.mark.parametrize("name", ["line", "time-optimal"])
def test_effort(name: str) -> None:
    """A drive whose effort is limited slows a motion, which then keeps that effort and uses it."""
    arm = without_gravity(with_drives(Limits(), Limits(effort=1e6), **FRICTION))
    free = PLANNERS[name](arm)
    at_rest = float(np.abs(drive_effort(arm, free.slowed(1000.0))).max())
    most = at_rest + (float(np.abs(drive_effort(arm, free)).max()) - at_rest) / 2
    weak = without_gravity(with_drives(Limits(), Limits(effort=most), **FRICTION))

    motion = PLANNERS[name](weak)

    assert motion.duration > 1.02 * free.duration
    assert 0.95 < np.abs(drive_effort(weak, motion)).max() / most < 1 + SEEN
    peaks = effort_peaks(weak, motion).peaks
    assert peaks.shape == (12,)
    assert peaks[7] == pytest.approx(np.abs(drive_effort(weak, motion)).max(), rel=SEEN)
    assert slowing_for_efforts(weak, free).joint == 1
    with pytest.raises(IncapableArmError, match="N m of the drive of joint 2, 1 N m are allowed"):
        slowing_for_efforts(with_drives(Limits(), Limits(effort=1.0)), free)


def test_the_certificate_names_the_joint() -> None:
    """The certificate of a line that a drive slows holds, and names its joint; a tighter drive would not keep it."""
    X = forward(FREE, START).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)
    most = float(np.abs(elbow(line(FREE), 1)).max()) / 3

    certificate = straight_line(with_drives(Limits(speed=most)), START, X).certificate

    assert certificate.holds
    assert certificate.because == ("speed", 2)
    assert certificate.use("speed")[0] == 2
    tighter = attrs.evolve(certificate, arm=with_drives(Limits(speed=most / 2)))
    assert not tighter.holds


def test_positions() -> None:
    """A line on which a drive would pass its limits is refused, by its name; so is a path for a time-optimal run."""
    free = elbow(line(FREE), 0)
    arm = with_drives(Limits(lower=float(free.min()) + 0.05))
    X = forward(FREE, START).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)

    with pytest.raises(PathError, match="the drive of joint 3 would be at"):
        straight_line(arm, START, X)
    with pytest.raises(InvalidValueError, match="path: the drive of joint 3 would be at"):
        time_optimal(arm, line(FREE))


def test_a_new_goal() -> None:
    """Joints that get a new goal are timed one by one: where a drive would pass a limit the goal is refused."""
    rest, goal = np.zeros(6), START + 0.5
    motion = retarget(with_drives(Limits(speed=100.0)), START, rest, rest, goal)
    most = float(np.abs(elbow(motion, 1)).max())

    with pytest.raises(OnlineError, match="the drive of joint 3 of 'puma560-seed' would move at"):
        retarget(with_drives(Limits(speed=most / 2)), START, rest, rest, goal)
    with pytest.raises(OnlineError, match="the drive of joint 3 of 'puma560-seed' would accelerate by"):
        retarget(with_drives(Limits(acceleration=0.1)), START, rest, rest, goal)


def test_stops(sample: Sample) -> None:
    """An arm that is stopped on its way brakes within the accelerations of its drives."""
    for rng in sample.cases(20):
        goal = START + rng.uniform(-0.5, 0.5, size=6)
        most = float(rng.uniform(0.5, 2.0))
        arm = with_drives(Limits(acceleration=most))
        motion = point_to_point(arm, START, goal, speed=120)
        stop = braked(arm, motion, float(rng.uniform(0.2, 0.8)) * motion.duration, period=1e-3).trajectory

        assert stop.coefficients.shape[2] == 6
        assert np.abs(elbow(stop, 2)).max() < most * (1 + SEEN)
        np.testing.assert_allclose(stop(stop.duration, 1), 0.0, atol=1e-9)
    sample.record("stops within the accelerations of coupled drives", sample.count(20), 0)
