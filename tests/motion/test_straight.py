"""Certified straight lines: what the certificate says is true."""

import attrs
import numpy as np
import pytest

import armwright
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.compiled import CompiledArm, compile_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, KindError
from armwright.kinematics.forward import forward
from armwright.motion.follow import PathError
from armwright.motion.straight import CertifiedLine, straight_line
from armwright.spatial.rotations import angle_between, rotation_from_vector, rotation_vector

ARMS = ("puma560-seed", "stanford", "ur5")
LINES = 1000  # on each arm; about half of them can be run
ROUNDING = 1e-9


@pytest.fixture(scope="module", params=ARMS)
def fast(request: pytest.FixtureRequest) -> CompiledArm:
    """An arm, compiled."""
    return compile_arm(load_arm(request.param))


def random_line(arm: Arm, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a posture inside the limits, and a pose up to half a metre and a radian away."""
    lower, upper = arm.limit("lower"), arm.limit("upper")
    q = rng.uniform(0.8 * lower + 0.2 * upper, 0.2 * lower + 0.8 * upper)
    X = forward(arm, q).copy()
    X[:3, 3] += rng.normal(size=3) * 0.2
    X[:3, :3] = X[:3, :3] @ rotation_from_vector(rng.normal(size=3) * 0.3)
    return q, X


def plain_line(puma: Arm, **manner: float) -> CertifiedLine:
    """Return a line of half a metre in the open."""
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
    X = forward(puma, q).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)
    return straight_line(puma, q, X, **manner)


def test_bounds_hold_for_a_hundred_times_the_looks(fast: CompiledArm) -> None:
    """On hundreds of random lines no sample, a hundred times denser than the looks, is beyond the certified bounds."""
    rng, arm = np.random.default_rng(3), fast.arm
    run = 0
    for _ in range(LINES):
        q, X_B = random_line(arm, rng)
        deviation = 10 ** rng.uniform(-4.5, -2)
        try:
            line = straight_line(fast, q, X_B, deviation=deviation)
        except PathError:
            continue
        run += 1
        certificate = line.certificate
        assert certificate.holds
        t = np.linspace(0.0, line.trajectory.duration, 100 * min(certificate.looks, 300))
        X, X_A = fast.forward(line.trajectory(t)), forward(arm, q)
        way = X_B[:3, 3] - X_A[:3, 3]
        come = X[:, :3, 3] - X_A[:3, 3]
        s = np.clip(come @ way / (way @ way), 0, 1)
        off = np.linalg.norm(come - s[:, None] * way, axis=-1)
        assert off.max() <= certificate.deviation + ROUNDING
        # The orientation that belongs to the nearest place differs from that of the progress by the lag along the line.
        turn = rotation_vector(X_A[:3, :3].T @ X_B[:3, :3])
        lag = deviation / np.linalg.norm(way) * np.linalg.norm(turn)
        twisted = angle_between(X_A[:3, :3] @ rotation_from_vector(s[:, None] * turn), X[:, :3, :3])
        assert twisted.max() <= certificate.turn + 2 * lag + ROUNDING
    assert run > LINES / 10


def test_limits_hold_between_samples(fast: CompiledArm) -> None:
    """Speeds, accelerations and positions keep their limits everywhere, by the roots of their derivatives."""
    rng, arm = np.random.default_rng(4), fast.arm
    for _ in range(60):
        q, X_B = random_line(arm, rng)
        try:
            line = straight_line(fast, q, X_B, speed=120)
        except PathError:
            continue
        motion = line.trajectory
        assert (motion.peaks(1) <= arm.limit("speed") * (1 + ROUNDING)).all()
        assert (motion.peaks(2) <= arm.limit("acceleration") * (1 + ROUNDING)).all()
        lowest, highest = motion.extremes(0)
        assert (lowest >= arm.limit("lower") - ROUNDING).all()
        assert (highest <= arm.limit("upper") + ROUNDING).all()
        np.testing.assert_allclose(line.certificate.peaks["speed"], motion.peaks(1), rtol=1e-9)
        np.testing.assert_allclose(line.certificate.peaks["acceleration"], motion.peaks(2), rtol=1e-9)
        t = np.linspace(0, motion.duration, 500)
        tau = np.abs(inverse_dynamics(arm, motion(t), motion(t, 1), motion(t, 2)))
        assert (tau.max(axis=0) <= arm.limit("effort") * (1 + 1e-3)).all()


def test_the_ends() -> None:
    """A line begins and ends at rest, at the posture and the pose asked for."""
    puma = load_arm("puma560-seed")
    line = plain_line(puma, deviation=1e-4)

    T = line.trajectory.duration
    np.testing.assert_allclose(line.trajectory([0, T], 1), 0, atol=1e-9)
    X = forward(puma, line.trajectory([0, T]))
    np.testing.assert_allclose(X[1, :3, 3] - X[0, :3, 3], (0.1, -0.4, -0.28), atol=1e-9)
    assert angle_between(X[0, :3, :3], X[1, :3, :3]) < 1e-9


def test_closer_takes_more_knots() -> None:
    """Ten thousand times closer takes about ten times the knots: the deviation falls with the step's fourth power."""
    coarse, fine = (plain_line(load_arm("puma560-seed"), deviation=d).certificate.knots for d in (1e-5, 1e-9))

    assert 5 < fine / coarse < 20


def test_compiled_and_plain_plan_the_same() -> None:
    """A compiled arm plans the line that the plain one plans."""
    puma = load_arm("puma560-seed")
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
    X = forward(puma, q).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)

    one, other = straight_line(puma, q, X), straight_line(compile_arm(puma), q, X)

    np.testing.assert_allclose(one.trajectory.coefficients, other.trajectory.coefficients, atol=1e-9)
    assert str(one.certificate) == str(other.certificate)


def test_an_effort_that_binds() -> None:
    """With drives that hardly hold the arm a line is slowed until gravity and motion together keep their limits."""
    puma = load_arm("puma560-seed")
    slow = plain_line(puma, speed=1)
    joints = [
        attrs.evolve(j, limits=attrs.evolve(j.limits, effort=1.02 * e, speed=np.inf, acceleration=np.inf))
        for j, e in zip(puma.joints, slow.certificate.peaks["effort"], strict=True)
    ]
    weak = attrs.evolve(puma, joints=joints)

    line = plain_line(weak, speed=120)

    assert line.certificate.because is not None
    assert line.certificate.because[0] == "effort"
    assert line.certificate.holds
    assert line.certificate.factor > 1


def test_no_way() -> None:
    """A line to the same pose takes no time."""
    puma = load_arm("puma560-seed")
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])

    line = straight_line(puma, q, forward(puma, q))

    assert line.trajectory.duration == 0
    assert line.certificate.holds


def test_whole_ticks() -> None:
    """With a servo period the line lasts a whole number of periods."""
    T = plain_line(load_arm("puma560-seed"), period=2e-3).trajectory.duration

    ticks = T / 2e-3
    assert abs(ticks - round(ticks)) < 1e-9


def test_what_stops_a_line() -> None:
    """Out of reach, beyond a limit and through a singularity are told apart, with the place on the line."""
    puma = load_arm("puma560-seed")
    q = np.array([0.0, 0.3, 0.2, 0.0, 0.8, 0.0])
    far = forward(puma, q).copy()
    far[:3, 3] *= 3

    with pytest.raises(PathError, match="mm out of reach of 'puma560-seed'") as reach:
        straight_line(puma, q, far)
    assert reach.value.cause == "reach"
    assert 0 < reach.value.fraction <= 1

    beyond = forward(puma, [2.9, 0.3, 0.2, 0.0, 0.8, 0.0])
    with pytest.raises(PathError, match=r"on the line near .* mm from the base joint \d would stand at") as limits:
        straight_line(puma, [2.7, 0.3, 0.2, 0.0, 0.8, 0.0], beyond)
    assert limits.value.cause == "limits"


def test_bad_manner() -> None:
    """A deviation, a turn and a speed that are none are refused with what came."""
    puma = load_arm("puma560-seed")
    for manner, words in (
        ({"deviation": 0.0}, "deviation: expected more than 0 m, got 0"),
        ({"deviation": float("nan")}, "deviation: expected more than 0 m, got nan"),
        ({"turn": -1.0}, "turn: expected more than 0 rad, got -1"),
        ({"speed": 121}, r"speed 121 is outside 1\.\.120"),
    ):
        with pytest.raises(InvalidValueError, match=words):
            plain_line(puma, **manner)
    for period in (0.0, -1e-3, float("nan")):
        with pytest.raises(InvalidValueError, match=f"period: expected more than 0 s, got {period}"):
            plain_line(puma, period=period)
    for name in ("deviation", "turn", "speed", "period"):
        with pytest.raises(KindError, match=f"{name}: expected a number, got 'little'"):
            plain_line(puma, **{name: "little"})  # type: ignore[arg-type]


def test_public_name() -> None:
    """The planner can be had from the package."""
    assert armwright.straight_line is straight_line
