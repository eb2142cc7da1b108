"""What stops the arm beside a singularity: named as a look of another kind finds it."""

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.singularity_analysis import singularities, singularity_factors
from armwright.motion.chain import chain, step_by_step
from armwright.motion.obstruction import PathError
from armwright.motion.plan import Manner, StageError, StageGoal, plan
from armwright.motion.solver import solver_of
from armwright.motion.straight import coarse_line, straight_line
from armwright.motion.tolerance import ROTATION_PER_METRE, Tolerance
from armwright.spatial.poses import between
from armwright.spatial.rotations import angle_between
from samples import Sample

# A configuration followed through whole turns stands beyond them.
pytestmark = pytest.mark.filterwarnings("ignore::armwright.errors.UnitWarning")

# Of each factor of the determinant: its number, and the joint that is turned until it has the value asked for.
FACTORS = {"shoulder": (0, 1), "elbow": (1, 2), "wrist": (2, 4)}
# How near the lines pass, in parts of the factor's scale.
DISTANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 0.0)
LINES = 8  # of each distance in `make proof`
# A factor is to blame below this part of its scale, a joint above this part of the idlest one's motion.
NEAR, BLAMED = 0.1, 0.3
# Distance of the upper arm from the axis of joint 1, of the PUMA and the Stanford arm, with some margin [m].
SHOULDER_OFFSET = 0.17
MET = 1e-8


def upright(puma: Arm) -> tuple[Array, Array, Array]:
    """Return the nearest configuration below, and the poses below and above one whose wrist is straight to 0.05 deg."""
    q = np.radians((20, 10, 60, 80, 0.05, -80))
    A, B = forward(puma, q).copy(), forward(puma, q).copy()
    A[2, 3] -= 0.15
    B[2, 3] += 0.15
    return inverse(puma, A, q).best.q, A, B


def nearly_singular(arm: Arm, factor: str, part: float, rng: np.random.Generator) -> Array:
    """Return a configuration inside the limits, one factor this part of its scale from zero, the others far from it."""
    number, turning = FACTORS[factor]
    lower, upper = arm.limits.lower, arm.limits.upper
    scales = np.array([one.scale for one in singularities(arm, (lower + upper) / 2).factors])
    while True:
        q = rng.uniform(0.9 * lower + 0.1 * upper, 0.1 * lower + 0.9 * upper)

        def off(x: float, q: Array = q) -> float:
            q[turning] = x
            return float(singularity_factors(arm, q)[number]) - part * scales[number]

        looks = np.linspace(lower[turning], upper[turning], 60)
        signs = np.sign([off(x) for x in looks])
        crossed = np.flatnonzero(signs[1:] * signs[:-1] < 0)
        if not len(crossed):
            continue
        k = rng.choice(crossed)
        q[turning] = brentq(off, looks[k], looks[k + 1], xtol=1e-14)
        if np.delete(np.abs(singularity_factors(arm, q)) / scales, number).min() > 0.2:
            return q


def lines_past(arm: Arm, factor: str, lines: int, rng: np.random.Generator) -> Iterator[tuple[Array, Array, Array]]:
    """Give lines that pass a singularity at several distances: configuration at the start, poses at both ends."""
    for part in DISTANCES:
        for _ in range(lines):
            q = nearly_singular(arm, factor, part * rng.choice((-1, 1)), rng)
            way = rng.normal(size=3)
            if factor == "shoulder" and rng.random() < 0.7:
                # Along the edge of what the arm reaches rather than across it.
                lost = np.linalg.svd(jacobian(arm, q))[0][:3, -1]
                way -= lost * (lost @ way) / (lost @ lost)
            way /= np.linalg.norm(way)
            # Across the edge that a straight elbow is at no line goes on; half of them end at it.
            before, after = rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.2) * (factor != "elbow" or rng.random() < 0.5)
            for side in (1, -1):
                A, B = forward(arm, q).copy(), forward(arm, q).copy()
                A[:3, 3] -= side * before * way
                B[:3, 3] += side * after * way
                start = inverse(arm, A, q)
                if start.allowed:
                    yield start.allowed[0].q, A, B
                    break


def refused(fast: CompiledArm, q: Array, B: Array, deviation: float) -> PathError | None:
    """Return why a line cannot be run; None where it can."""
    try:
        assert straight_line(fast, q, B, deviation=deviation).certificate.holds
    except PathError as error:
        return error
    return None


def blamed(fast: CompiledArm, A: Array, B: Array, fraction: float) -> set[tuple[str, int]]:
    """Return each singularity near a place of a line with each joint that moves much in the motion that goes idle.

    All configurations of the closed form are sampled, densely about the position, and their Jacobians decide.
    """
    arm, found = fast.arm, set()
    around = np.clip(fraction + np.sinh(np.linspace(-8, 8, 401)) / np.sinh(8) * 0.03, 0, 1)
    q = fast.inverse_branches(between(A, B, around), np.zeros((len(around), 6)))[0]
    factors = singularities(arm, q[0, 0]).factors
    off = np.abs(singularity_factors(arm, q)) / np.array([one.scale for one in factors])
    for branch in range(8):
        for number, factor in enumerate(factors):
            k = int(off[:, branch, number].argmin())
            if off[k, branch, number] < NEAR:
                idle = np.abs(np.linalg.svd(jacobian(arm, q[k, branch]))[2][-1]) / arm.limits.speed
                found |= {(factor.name, j + 1) for j in np.flatnonzero(idle > BLAMED * idle.max())}
    return found


def lifted(fast: CompiledArm, q_start: Array, A: Array, B: Array) -> Array:
    """Return configurations (k, 6) along a line: those of the first one's branch, solved densely and unwrapped."""
    s = np.linspace(0, 1, 8001)
    found = fast.inverse_branches(between(A, B, s), np.broadcast_to(q_start, (len(s), 6)))[0]
    q = found[:, int(np.abs(found[0] - q_start).max(axis=-1).argmin())]
    turns = [joint.revolute for joint in fast.arm.joints]
    steps = np.diff(q, axis=0)
    return q_start + np.cumsum(steps - np.where(turns, 2 * np.pi * np.round(steps / (2 * np.pi)), 0.0), axis=0)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        (name, factor)
        for name in ("puma560-seed", "ur5", "stanford")
        for factor in FACTORS
        if (name, factor[0]) != ("stanford", "e")
    ],
)
@pytest.mark.drawn(0.4)
@pytest.mark.share(0.25)
def test_the_singularity_and_a_joint_to_blame_are_named(
    name: str, factor: str, rng: np.random.Generator, sample: Sample
) -> None:
    """What a refused line names is a factor that is small there, and a joint that moves for nothing where it is 0.

    A limit that is named is passed by the branch of the start as well, followed densely, unless two branches of the
    wrist or the shoulder merge on the way within the deviation, so that the arm went on on the other one.
    """
    fast = compile_arm(load_arm(name))
    arm, causes, lines = fast.arm, Counter[str](), sample.count(LINES)
    lower, upper = arm.limits.lower, arm.limits.upper
    for q, A, B in lines_past(arm, factor, lines, rng):
        deviation = 10 ** rng.uniform(-4.5, -3)
        error = refused(fast, q, B, deviation)
        causes["run" if error is None else error.cause] += 1
        if error is not None and error.cause == "singular":
            named = {word for word in ("shoulder", "elbow", "slide", "wrist") if f"({word})" in str(error)}
            assert len(named) == 1, str(error)
            assert (named.pop(), error.joint) in blamed(fast, A, B, error.fraction), str(error)
        if error is not None and error.joint is not None and error.cause == "limits" and name != "ur5":
            way, j = lifted(fast, q, A, B), error.joint - 1
            shoulder, _, wrist = np.abs(singularity_factors(arm, way)).min(axis=0)
            # The square of the shoulder's factor is twice the offset times how far the wrist is outside it.
            merged = shoulder**2 < 2 * SHOULDER_OFFSET * deviation or wrist < 2 * ROTATION_PER_METRE * deviation
            assert merged or (way[:, j] < lower[j]).any() or (way[:, j] > upper[j]).any(), str(error)
    assert causes["run"] > lines, causes
    assert causes["limits"] + causes["singular"] > lines or factor != "wrist", causes


@pytest.mark.parametrize("deviation", [1e-3, 1e-4, 1e-5])
def test_the_wrist_is_to_blame_and_not_the_elbow(deviation: float) -> None:
    """Beside a straight wrist joints 4 and 6 have to turn over; that the other elbow would be nearer is no way out."""
    puma = load_arm("puma560-seed")
    q, _, B = upright(puma)
    manner = Manner(deviation=deviation)

    with pytest.raises(PathError, match=r"singular there \(wrist\), joint [46] would have to move") as by_knots:
        straight_line(puma, q, B, deviation=deviation)
    with pytest.raises(PathError, match=r"joint [46] would") as by_rule:
        coarse_line(puma, q, B, deviation=deviation, speed=100)
    with pytest.raises(StageError) as planned:
        plan(puma, q, [StageGoal(kind="LINE", poses=B[None])], manner)

    assert by_knots.value.cause == "singular"
    assert {by_knots.value.joint, by_rule.value.joint, planned.value.obstacle.joint} <= {4, 6}


def test_the_configurations_of_a_close_look_belong_together() -> None:
    """The nearest configuration to the last hops to the other elbow; finer sampling never lets the tool leave the line.

    Elbow up is where tan q3 is above d4 / a3.
    """
    puma = load_arm("puma560-seed")
    q, A, B = upright(puma)
    allowed, straight = Tolerance(1e-3, 5e-3), np.arctan2(0.433, -0.02)
    X = between(A, B, np.linspace(0, 1, 9))

    hasty, _ = chain(solver_of(puma), X, q)
    steps = list(step_by_step(solver_of(puma), X, q, allowed))

    assert np.ptp(np.sign(hasty[:, 2] - straight)) == 2
    assert np.ptp(np.sign([step.q[2] - straight for step in steps])) == 0
    assert [step.place for step in steps] == sorted(step.place for step in steps)
    assert {step.place for step in steps} >= set(range(9))
    for first, last in pairwise(steps):
        np.testing.assert_allclose(forward(puma, last.q), last.X, atol=MET)
        off, on = forward(puma, (first.q + last.q) / 2), between(first.X, last.X, 0.5)
        assert np.linalg.norm(off[:3, 3] - on[:3, 3]) <= allowed.position
        assert angle_between(off[:3, :3], on[:3, :3]) <= allowed.orientation


def test_an_arm_without_a_closed_form_is_checked_as_well() -> None:
    """Moved out of its closed form by a hair, the PUMA is stopped by the same joints, at the same place."""
    puma = load_arm("puma560-seed")
    q, _, B = upright(puma)
    joints = [attrs.evolve(joint, a=joint.a + 1e-7 * (i == 4)) for i, joint in enumerate(puma.joints)]
    bent = attrs.evolve(puma, joints=joints)

    assert solver_of(bent).inverse_branches is None
    with pytest.raises(PathError, match=r"singular there \(singular value 6\), joint [46] would") as caught:
        straight_line(bent, q, B, deviation=1e-4)
    with pytest.raises(PathError) as closed:
        straight_line(puma, q, B, deviation=1e-4)
    assert caught.value.joint == closed.value.joint
    assert abs(caught.value.fraction - closed.value.fraction) < 0.01
