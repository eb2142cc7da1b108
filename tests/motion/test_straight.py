"""Certified straight lines: what the certificate says is true."""

from collections import Counter

import attrs
import numpy as np
import pytest

import armwright
from armwright.arm.load import arm_names, load_arm
from armwright.arm.model import Arm
from armwright.arm.reach import stretched_length
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, KindError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.certified_motion import CertifiedMotion
from armwright.motion.obstruction import PathError
from armwright.motion.straight import straight_line
from armwright.spatial.rotations import angle_between, rotation_from_vector, rotation_vector
from samples import Sample

ARMS = ("puma560", "stanford", "ur5")
LINES = 2000  # on each arm; about half of them can be run
COMPARED, COMPARED_ELSEWHERE = 1000, 0.005  # on each arm
ROUNDING = 1e-9
# How far the plans of two ways to evaluate the same equations may be apart: distances, angles, and the rest.
SAME, SAME_ANGLE, SAME_RUN = 1e-12, 1e-10, 1e-8
# An angle taken from the cosine of a small turn is good to the root of a rounding.
ANGLE_ROUNDING = 5e-8


@pytest.fixture(scope="module", params=ARMS)
def fast(request: pytest.FixtureRequest) -> CompiledArm:
    """An arm, compiled."""
    return compile_arm(load_arm(request.param))


def random_line(arm: Arm, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a configuration inside the limits, and a pose up to half a metre and a radian away."""
    lower, upper = arm.limits.lower, arm.limits.upper
    q = rng.uniform(0.8 * lower + 0.2 * upper, 0.2 * lower + 0.8 * upper)
    X = forward(arm, q).copy()
    X[:3, 3] += rng.normal(size=3) * 0.2
    X[:3, :3] = X[:3, :3] @ rotation_from_vector(rng.normal(size=3) * 0.3)
    return q, X


def plain_line(puma: Arm, **manner: float) -> CertifiedMotion:
    """Return a line of half a metre in the open."""
    q = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])
    X = forward(puma, q).copy()
    X[:3, 3] += (0.1, -0.4, -0.28)
    return straight_line(puma, q, X, **manner)


def strayed(
    line: CertifiedMotion, fast: CompiledArm, X_A: Array, X_B: Array, samples: int
) -> tuple[float, float, float]:
    """Return how far the tool is off a line, its rotation off the planned orientation, and how far it runs back."""
    X = fast.forward(line.trajectory(np.linspace(0.0, line.trajectory.duration, samples)))
    way, come = X_B[:3, 3] - X_A[:3, 3], X[:, :3, 3] - X_A[:3, 3]
    along = come @ way / (way @ way)
    s = np.clip(along, 0, 1)
    off = np.linalg.norm(come - s[:, None] * way, axis=-1)
    turn = rotation_vector(X_A[:3, :3].T @ X_B[:3, :3])
    twisted = angle_between(X_A[:3, :3] @ rotation_from_vector(s[:, None] * turn), X[:, :3, :3])
    back = (np.maximum.accumulate(along) - along).max() * np.linalg.norm(way)
    return float(off.max()), float(twisted.max()), float(back)


@pytest.mark.share(0.02)
@pytest.mark.drawn(0.34)
def test_bounds_hold_for_a_hundred_times_the_samples(fast: CompiledArm, sample: Sample) -> None:
    """On no line is a pose beyond the certified bounds: off the line, turned for its place on it, run backwards.

    Lines of 10 um to half a metre, turning by up to a radian, sampled a hundred times as densely as the certificate
    did. The turn is that from the orientation that belongs to the position on the line nearest to the tool.
    """
    arm, run, worst = fast.arm, 0, 0.0
    for rng in sample.cases(LINES):
        q, X_B = random_line(arm, rng)
        X_A = forward(arm, q)
        way = X_B[:3, 3] - X_A[:3, 3]
        X_B[:3, 3] = X_A[:3, 3] + way * 10 ** rng.uniform(-4, 0)
        deviation = 10 ** rng.uniform(-4.5, -2)
        try:
            line = straight_line(fast, q, X_B, deviation=deviation)
        except PathError:
            continue
        certificate = line.certificate
        assert certificate.holds
        samples = 100 * min(certificate.samples, 300)
        off, twisted, back = strayed(line, fast, X_A, X_B, samples)
        assert off <= certificate.deviation + ROUNDING
        if np.linalg.norm(X_B[:3, 3] - X_A[:3, 3]) <= deviation:
            continue
        assert twisted <= certificate.rotation + ANGLE_ROUNDING
        assert certificate.backward is not None
        assert back <= certificate.backward + ROUNDING
        run += 1
        worst = max(worst, off / certificate.deviation, twisted / certificate.rotation)
    sample.record(f"lines of the {arm.name} at 100 times as many samples", run, 0, worst_of_bound=f"{worst:.3f}")


def test_short_line_with_a_large_turn() -> None:
    """Ten millimetres with a turn of a radian: the turn is right for where the tool is, not for where it should be."""
    fast = compile_arm(load_arm("puma560"))
    q = np.radians([10.0, -30.0, 40.0, 20.0, 50.0, 10.0])
    X_A = forward(fast.arm, q)
    X_B = X_A.copy()
    X_B[:3, 3] += (0.006, -0.008, 0.0)
    X_B[:3, :3] = X_A[:3, :3] @ rotation_from_vector(np.array([0.6, 0.0, 0.8]))

    line = straight_line(fast, q, X_B, deviation=1e-4)

    off, twisted, _ = strayed(line, fast, X_A, X_B, 100_001)
    assert line.certificate.holds
    assert off <= line.certificate.deviation <= 1e-4
    assert twisted <= line.certificate.rotation <= 5e-4


@pytest.mark.share(0.01)
def test_lines_of_any_arm_of_the_catalogue(sample: Sample) -> None:
    """An arm whose file states neither reach nor tool speed runs lines too, as far as certified, within its limits."""
    names = [name for name in arm_names() if load_arm(name).n > 3]
    stopped = 0
    for rng in sample.cases(700):
        arm = load_arm(names[rng.integers(len(names))])
        middle = np.clip(0.0, arm.limits.lower, arm.limits.upper)
        q = middle + (np.clip(rng.uniform(-2, 2, arm.n), arm.limits.lower, arm.limits.upper) - middle) * 0.7
        X_A = forward(arm, q)
        X_B = X_A.copy()
        X_B[:3, 3] += rng.normal(size=3) * 0.03
        try:
            line = straight_line(arm, q, X_B)
        except PathError:  # a singularity, a limit, or five joints that cannot keep the direction
            stopped += 1
            continue
        motion, way = line.trajectory, X_B[:3, 3] - X_A[:3, 3]
        come = forward(arm, motion(np.linspace(0, motion.duration, 500)))[:, :3, 3] - X_A[:3, 3]
        off = come - np.clip(come @ way / (way @ way), 0, 1)[:, None] * way
        assert np.linalg.norm(off, axis=-1).max() <= line.certificate.deviation + ROUNDING
        assert line.certificate.holds
        assert (motion.peaks(1) <= arm.limits.speed * (1 + ROUNDING)).all()
        assert (motion.peaks(2) <= arm.limits.acceleration * (1 + ROUNDING)).all()
    sample.record("lines of the arms of the catalogue", sample.count(700), 0, stopped=stopped)


def test_speed_without_stated_reach_and_tool_speed() -> None:
    """The length of the stretched arm and 1 m/s stand for what the file does not state."""
    stated = load_arm("ur5")
    plain = attrs.evolve(stated, reach=np.inf, tool_speed=np.inf)
    q = np.radians([0.0, -60.0, 80.0, -110.0, -90.0, 0.0])
    X = forward(plain, q).copy()
    X[:3, 3] += (0.0, 0.1, 0.0)

    line = straight_line(plain, q, X, speed=20)
    same = straight_line(attrs.evolve(stated, reach=stretched_length(plain), tool_speed=1.0), q, X, speed=20)

    # d1, a2, a3, d4, d5 and d6 of the maker, one behind the other.
    assert stretched_length(plain) == pytest.approx(0.089159 + 0.425 + 0.39225 + 0.10915 + 0.09465 + 0.0823)
    assert line.trajectory.duration == same.trajectory.duration


@pytest.mark.drawn(0.34)
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
        assert (motion.peaks(1) <= arm.limits.speed * (1 + ROUNDING)).all()
        assert (motion.peaks(2) <= arm.limits.acceleration * (1 + ROUNDING)).all()
        lowest, highest = motion.extremes(0)
        assert (lowest >= arm.limits.lower - ROUNDING).all()
        assert (highest <= arm.limits.upper + ROUNDING).all()
        np.testing.assert_allclose(line.certificate.peaks["speed"], motion.peaks(1), rtol=1e-9)
        np.testing.assert_allclose(line.certificate.peaks["acceleration"], motion.peaks(2), rtol=1e-9)
        t = np.linspace(0, motion.duration, 500)
        tau = np.abs(inverse_dynamics(arm, motion(t), motion(t, 1), motion(t, 2)))
        assert (tau.max(axis=0) <= arm.limits.effort * (1 + 1e-3)).all()


def test_the_ends() -> None:
    """A line begins and ends at rest, at the configuration and the pose asked for."""
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


def line_or_refusal(arm: Arm | CompiledArm, q: Array, X_B: Array, **manner: float) -> CertifiedMotion | PathError:
    """Return a line, or why there is none."""
    try:
        return straight_line(arm, q, X_B, **manner)
    except PathError as error:
        return error


def compared(fast: CompiledArm, rng: np.random.Generator) -> str:
    """Plan a random line with a plain and with a compiled arm, which must come to the same.

    Returns:
        Whether it is ``run`` or ``refused``; ``elsewhere`` where it is refused at another place.
    """
    q, X_B = random_line(fast.arm, rng)
    X_A = forward(fast.arm, q)
    X_B[:3, 3] = X_A[:3, 3] + (X_B[:3, 3] - X_A[:3, 3]) * 10 ** rng.uniform(-4, 0)
    manner = {"deviation": 10 ** rng.uniform(-4.5, -2), "speed": rng.uniform(1, 120)}
    one, two = (line_or_refusal(arm, q, X_B, **manner) for arm in (fast.arm, fast))
    if isinstance(one, PathError):
        assert isinstance(two, PathError)
        assert (one.cause, one.segment) == (two.cause, two.segment)
        if one.fraction != pytest.approx(two.fraction, abs=SAME, rel=0):
            return "elsewhere"
        assert one.joint == two.joint
        return "refused"
    assert isinstance(two, CertifiedMotion)
    mine, same = one.certificate, two.certificate
    assert (mine.holds, mine.knots, mine.samples, mine.because) == (same.holds, same.knots, same.samples, same.because)
    # The orientation is held against that of the position on the line: the shorter a line that rotates, the more a
    # difference of positions rotates it.
    turn = float(angle_between(X_A[:3, :3], X_B[:3, :3])) / float(np.linalg.norm(X_B[:3, 3] - X_A[:3, 3]))
    for name, apart in (("deviation", SAME), ("rotation", SAME_ANGLE + turn * SAME)):
        assert getattr(mine, name) == pytest.approx(getattr(same, name), abs=apart, rel=0)
        sampled = f"{name}_sampled"
        assert getattr(mine, sampled) == pytest.approx(getattr(same, sampled), abs=apart, rel=0)
    assert one.trajectory.duration == pytest.approx(two.trajectory.duration, rel=SAME_RUN)
    for limit, peaks in mine.peaks.items():
        np.testing.assert_allclose(peaks, same.peaks[limit], rtol=SAME_RUN, atol=SAME_RUN)
    t = np.linspace(0.0, 1.0, 50)
    q_one, q_two = (each.trajectory(t * each.trajectory.duration) for each in (one, two))
    np.testing.assert_allclose(q_one, q_two, rtol=0, atol=SAME_RUN)
    return "run"


@pytest.mark.share(0.02)
def test_certificates_are_those_of_the_plain_arm(fast: CompiledArm, sample: Sample) -> None:
    """A compiled arm certifies what a plain one does, and refuses the same lines for the same reasons.

    The distances agree to 1e-12 m, the angles to 1e-10, as a nearly singular wrist magnifies rounding, and to what such
    a distance rotates the line, the run to 1e-8.
    Where the wrist is singular rounding decides which of two configurations is nearer: there a line in hundreds is
    refused by a compiled arm at another place on it, for the same reason, of another joint of the wrist maybe.
    """
    counts = Counter(compared(fast, rng) for rng in sample.cases(COMPARED))
    assert counts["elsewhere"] <= max(1, COMPARED_ELSEWHERE * counts.total())
    sample.record(f"lines of the {fast.arm.name}, by a compiled and a plain arm", counts.total(), 0, **counts)


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
    with pytest.raises(PathError, match=r"on the line near .* mm from the base joint \d would be at") as limits:
        straight_line(puma, [2.7, 0.3, 0.2, 0.0, 0.8, 0.0], beyond)
    assert limits.value.cause == "limits"


def test_bad_manner() -> None:
    """A deviation, a turn and a speed that are none are refused with what came."""
    puma = load_arm("puma560-seed")
    for manner, words in (
        ({"deviation": 0.0}, "deviation: expected 1e-09 m or more, the closest that can be certified, got 0"),
        (
            {"deviation": float("nan")},
            "deviation: expected 1e-09 m or more, the closest that can be certified, got nan",
        ),
        ({"deviation": 1e-12}, "deviation: expected 1e-09 m or more, the closest that can be certified, got 1e-12"),
        ({"rotation": -1.0}, "rotation: expected 1e-09 rad or more, the closest that can be certified, got -1"),
        ({"speed": 121}, r"speed 121 is outside 1\.\.120"),
    ):
        with pytest.raises(InvalidValueError, match=words):
            plain_line(puma, **manner)
    for period in (0.0, -1e-3, float("nan")):
        with pytest.raises(InvalidValueError, match=f"period: expected more than 0 s, got {period}"):
            plain_line(puma, period=period)
    for name in ("deviation", "rotation", "speed", "period"):
        with pytest.raises(KindError, match=f"{name}: expected a number, got 'little'"):
            plain_line(puma, **{name: "little"})  # type: ignore[arg-type]


def test_public_name() -> None:
    """The planner can be had from the package."""
    assert armwright.motion.straight_line is straight_line
