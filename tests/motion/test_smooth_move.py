"""Moves of arms with flexible gears: shapers, flat feedforward, what they leave of vibrations and straight lines."""

import json
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.linalg import expm

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import planning_arm
from armwright.dynamics.flexible_joints import deflection, gear_efforts, links_at_rest, modes, with_gears
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.deviation import distance_from_line
from armwright.motion.flat_feedforward import flat_motion, ninth
from armwright.motion.limit_utilization import limit_use
from armwright.motion.moves import cartesian_move, joint_move
from armwright.motion.quintic_polynomials import quintic
from armwright.motion.shaping import Shaper, ShaperKind, combined, shaped, shaper
from armwright.motion.smooth_move import settling, smooth_move
from armwright.motion.tolerance import tolerance
from armwright.simulation.flexible_joints import simulate_flexible
from cli_calls import armwright
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
TWO_LINKS = load_arm(str(EXAMPLES / "two_link_springs.toml"))
START, GOAL = np.array((0.2, 0.3)), np.array((1.0, 1.2))
PLAIN = quintic(START, GOAL, 0.5)
UR5 = with_gears(load_arm("ur5"), [6e4, 6e4, 4e4, np.inf, np.inf, np.inf], 20.0)


def left_over(by: Shaper, frequency: float, damping: float) -> float:
    """The vibration of an oscillator that a shaped step leaves, by that which a plain step leaves until then."""
    omega = 2 * np.pi * frequency
    A = np.array(((0, 1), (-(omega**2), -2 * damping * omega)))
    state, command = np.zeros(2), 0.0
    for part, wait in zip(by.parts, (*np.diff(by.delays), 0.0), strict=True):
        command += part
        state = np.array((command, 0)) + expm(A * wait) @ (state - (command, 0))
    swing, rate = state - (command, 0)
    fast = omega * np.sqrt(1 - damping**2)
    shrunk = np.exp(-damping * omega * by.duration) / np.sqrt(1 - damping**2)
    return float(np.hypot(swing, (rate + damping * omega * swing) / fast) / shrunk)


@pytest.mark.parametrize("kind", ["zv", "zvd", "ei"])
def test_sensitivity(kind: ShaperKind) -> None:
    """On an oscillator of another frequency each shaper leaves what its closed form says."""
    by = shaper(kind, 5.0, tolerance=0.05)
    for ratio in np.linspace(0.4, 1.6, 25).tolist():
        cosine = np.cos(np.pi / 2 * ratio)
        expected = {"zv": abs(cosine), "zvd": cosine**2, "ei": abs(1.05 * np.cos(np.pi * ratio) + 0.95) / 2}[kind]

        assert left_over(by, 5.0 * ratio, 0.0) == pytest.approx(expected, abs=1e-9)
        assert by.residual(5.0 * ratio) == pytest.approx(expected, abs=1e-12)


def test_damped_shapers(sample: Sample) -> None:
    """ZV and ZVD leave nothing of a damped mode, ZVD little near it, EI its tolerance; together they do for two."""
    for rng in sample.cases(100):
        (f, g), z = rng.uniform(5, 15, 2), rng.uniform(0, 0.2)

        assert left_over(shaper("zv", f, z), f, z) < 1e-10
        assert left_over(shaper("zvd", f, z), f, z) < 1e-10
        assert left_over(shaper("ei", f, z, tolerance=0.04), f, z) == pytest.approx(0.04, rel=1e-9)
        both = combined([shaper("zvd", f, z), shaper("zv", g, z)])
        assert left_over(both, f, z) < 1e-9
        assert left_over(both, g, z) < 1e-9
        assert both.residual(1.1 * f, z) == pytest.approx(left_over(both, 1.1 * f, z), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("more", [(), (23.0, 31.0, 57.0, 93.0)])
def test_shaped_motion(rng: np.random.Generator, more: tuple[float, ...]) -> None:
    """A shaped motion is the sum of its delayed parts, between all knots, and no faster than before."""
    by = combined([shaper("zvd", 7.4, 0.01), shaper("ei", 19.0, 0.02), *(shaper("zvd", f) for f in more)])
    found = shaped(PLAIN, by)
    t = rng.uniform(-0.1, found.duration + 0.1, 300)

    assert found.duration == pytest.approx(0.5 + by.duration)
    for order in range(3):
        parts = (part * PLAIN(t - delay, order) for part, delay in zip(by.parts, by.delays, strict=True))
        np.testing.assert_allclose(found(t, order), sum(parts), atol=1e-9)
        assert order == 0 or (found.peaks(order) <= PLAIN.peaks(order) * (1 + 1e-12)).all()


def test_flat_links() -> None:
    """The motors of flat feedforward move the links as they should, and their efforts are those of the simulation."""
    flat = flat_motion(TWO_LINKS, ninth(START, GOAL, 0.5))
    np.testing.assert_allclose([flat.links(x, k) for x in (0.0, 0.5) for k in range(1, 5)], 0, atol=1e-7)
    lag = flat.motors(0.0) - START
    assert (lag > 0).all()

    found = simulate_flexible(TWO_LINKS, START, duration=0.5, motors=flat.motors, period=0.05)

    np.testing.assert_allclose(found.q, flat.links(found.t), atol=5e-6)
    np.testing.assert_allclose(found.tau[1:-1], flat.efforts[80:-1:80], atol=0.1)


def test_flat_motors(rng: np.random.Generator) -> None:
    """Motors are as near to their formula as is said, begin and end at rest, and stay with links on rigid gears."""
    damped = with_gears(TWO_LINKS, [6000.0, np.inf], [3.0, 1.0])
    for arm in (TWO_LINKS, damped):
        flat = flat_motion(arm, ninth(START, GOAL, 0.4))
        t, h = rng.uniform(0.01, 0.39, 200), 1e-5
        tau, before, after = (gear_efforts(arm, *(flat.links(t + x, order) for order in range(3))) for x in (0, -h, h))
        K, D = arm.motor_values("stiffness"), arm.motor_values("damping")
        exact = flat.links(t) + (tau - D / K * (after - before) / (2 * h)) / K

        assert (np.abs(flat.motors(t) - exact) <= flat.error + 1e-10).all()
        assert flat.error.max() < 3e-5
        ends = np.array((0.0, 0.4))
        np.testing.assert_allclose(flat.motors(ends), (START, GOAL) - deflection(arm, (START, GOAL)), atol=1e-12)
        assert max(np.abs(flat.motors(ends, order)).max() for order in (1, 2)) < 1e-7
        for order in (0, 1, 2):
            inside = flat.motors.times[1:-1]
            np.testing.assert_allclose(flat.motors(inside - 1e-12, order), flat.motors(inside, order), atol=1e-6)
        np.testing.assert_allclose(links_at_rest(arm, flat.motors(0.4)), GOAL, atol=1e-12)
    assert not np.abs(flat.motors(t) - flat.links(t))[:, 1].max() > 1e-12


def test_positions_of_flat_motors() -> None:
    """Motors swing within the limits of their joints, by a slower motion where inertia bends the gear, not weight."""
    limits = attrs.evolve(TWO_LINKS.joints[1].limits, upper=0.301)
    limited = attrs.evolve(TWO_LINKS, joints=[TWO_LINKS.joints[0], attrs.evolve(TWO_LINKS.joints[1], limits=limits)])
    ends = [links_at_rest(limited, theta) for theta in ((-1.0, 0.3), (1.0, 0.3))]
    fast = flat_motion(limited, ninth(*ends, 0.6))

    with pytest.raises(IncapableArmError, match=r"gears yield on the way, and the motor of joint 2 would be at"):
        fast.slowing(limited)

    lying = attrs.evolve(limited, gravity=np.zeros(3))
    fast = flat_motion(lying, ninth(*np.array(((-1.0, 0.3), (1.0, 0.3))), 0.8))
    factor, _limit = fast.slowing(lying)
    slow = flat_motion(lying, fast.links.slowed(factor * 1.001))
    assert fast.motors.extremes()[1][1] > 0.301 > slow.motors.extremes()[1][1]
    assert slow.slowing(lying)[0] == 1


def zvd() -> Shaper:
    """The shaper for both modes, of their means along the plain move."""
    found = modes(TWO_LINKS, PLAIN(np.linspace(0, 0.5, 101)))
    return combined([shaper("zvd", *pair) for pair in np.array(found[:2]).mean(axis=1).T.tolist()])


def test_residual_of_two_links() -> None:
    """Of the vibration after a fast move of two links ZVD and flat feedforward leave a hundredth at most."""
    plain = settling(TWO_LINKS, PLAIN)

    assert plain.residual > 5e-3
    assert settling(TWO_LINKS, shaped(PLAIN, zvd())).residual < 0.01 * plain.residual
    flat = settling(TWO_LINKS, flat_motion(TWO_LINKS, ninth(START, GOAL, 0.5)).motors)
    assert flat.residual < 0.01 * plain.residual
    assert flat.time is not None
    assert flat.time < 0.5


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_residual_at_other_frequencies(factor: float) -> None:
    """Where frequencies are 10 % off, ZVD leaves 8 % at most."""
    stiffness = TWO_LINKS.motor_values("stiffness") * factor**2
    other = with_gears(TWO_LINKS, stiffness, TWO_LINKS.motor_values("damping"))

    assert settling(other, shaped(PLAIN, zvd())).residual < 0.08 * settling(other, PLAIN).residual


def poses(*, apart: float = 0.1) -> Array:
    """Poses of the hand of a UR5 on a straight line."""
    X = np.tile(np.diag((1.0, -1.0, -1.0, 1.0)), (2, 1, 1))
    X[:, :3, 3] = (0.5, -apart, 0.1), (0.48, apart, 0.15)
    return X


def test_straight_line() -> None:
    """The bounds of a shaped line hold between all samples, and a line that would be left is refused with them."""
    arm, X = planning_arm(UR5), poses()
    move = cartesian_move(arm, X)
    part = shaped(move.trajectory, shaper("zv", 20.0))

    found = distance_from_line(UR5, part, *X).largest

    p = forward(UR5, part(np.linspace(0, part.duration, 20_000)))
    along = (X[1] - X[0])[:3, 3] / np.linalg.norm((X[1] - X[0])[:3, 3])
    off = p[:, :3, 3] - X[0, :3, 3]
    seen = np.linalg.norm(off - np.outer(off @ along, along), axis=1).max()
    assert seen <= found.position < 1.2 * seen + 2e-6
    angle = np.arccos(np.clip((np.einsum("kij,ij->k", p[:, :3, :3], X[0, :3, :3]) - 1) / 2, -1, 1)).max()
    assert angle <= found.orientation + 1e-7
    with pytest.raises(InvalidValueError, match=r"the straight line from pose 1 to pose 2 would be left by up to"):
        smooth_move(arm, move, "zvd", allowed=tolerance(found.position / 50))
    with pytest.raises(InvalidValueError, match="flat feedforward needs four derivatives"):
        smooth_move(arm, move, "flat", allowed=tolerance(1e-3))
    three = np.concatenate([X, X[:1]])
    with pytest.raises(InvalidValueError, match="past 1 pose without a stop"):
        smooth_move(arm, cartesian_move(arm, three), "zv", allowed=tolerance(1e-2))
    with pytest.raises(InvalidValueError, match="starts and ends at rest"):
        smooth_move(arm, cartesian_move(arm, X, ends="running"), "zv", allowed=tolerance(1e-2))


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("smoothing", ["zv", "flat"])
def test_limits_are_kept(smoothing: str) -> None:
    """Links and motors of a smooth move keep the limits of speed, acceleration and effort, weak motors too."""
    limits = attrs.evolve(UR5.joints[0].limits, effort=25.0)
    weak = attrs.evolve(UR5, joints=[attrs.evolve(UR5.joints[0], limits=limits), *UR5.joints[1:]])
    arm = planning_arm(weak)
    move = joint_move(arm, poses(apart=0.15))

    found = smooth_move(arm, move, smoothing, allowed=tolerance(1e-3))

    assert max(use.max() for use in limit_use(arm, found.move.trajectory).values()) <= 1 + 1e-6
    assert found.added > 0
    assert found.deviation < 1e-4
    assert found.after.residual <= found.before.residual


def test_soft_gears() -> None:
    """Gears that do not carry the arm are refused, and those that vibrate for minutes, where nothing is heavy."""
    with pytest.raises(IncapableArmError, match="so soft that its weight bends them"):
        settling(with_gears(TWO_LINKS, 10.0), PLAIN)
    lying = attrs.evolve(with_gears(TWO_LINKS, 0.01), gravity=np.zeros(3))
    move = joint_move(lying, forward(lying, np.array((START, GOAL))))
    with pytest.raises(InvalidValueError, match="zvd would add"):
        smooth_move(lying, move, "zvd", allowed=tolerance(1e-3))


def test_refused_shapers() -> None:
    """Numbers that no oscillator has, and too many modes, are refused."""
    with pytest.raises(InvalidValueError, match="damping: expected 0 or more and below 1, got 1"):
        shaper("zv", 5.0, 1.0)
    with pytest.raises(InvalidValueError, match="frequency"):
        shaper("zv", 0.0)
    with pytest.raises(InvalidValueError, match="expected fewer"):
        combined([shaper("zvd", f) for f in range(1, 9)])


def test_command(tmp_path: Path) -> None:
    """The command prints vibrations before and after; without --smooth it knows no gears."""
    files = ("move", "joint", EXAMPLES / "two_link_springs.toml", EXAMPLES / "two_link_poses.toml", "--no-film")
    done = armwright(*files, "--smooth", "flat", "--json", cwd=tmp_path)
    refused = armwright(*files, "--stiffness", "1e5")

    vibration = json.loads(done.stdout)["vibration"]
    assert vibration["after"]["residual"] < 0.05 * vibration["before"]["residual"]
    assert vibration["added_s"] > 0
    assert refused.returncode == 2
    assert "expected --smooth with the stiffness" in " ".join(refused.stderr.replace("│", " ").split())
