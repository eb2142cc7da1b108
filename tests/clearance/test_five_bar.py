"""The five-bar in closed form: against the generic linkage, against itself, and at its borders."""

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from armwright.clearance import ideal
from armwright.clearance.five_bar import MODES, FiveBar, arm_angles, inverse, inverse_all
from armwright.clearance.five_bar_parts import five_bar_coordinates
from armwright.clearance.five_bar_workspace import (
    boundary_distance,
    condition_number,
    jacobian,
    singular_curves,
    singularity_sines,
    workspace,
)
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Pin
from armwright.clearance.paths import thesis_path
from armwright.clearance.placement import Vec2
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from clearance.five_bar_motion import ASSEMBLIES, accelerations, forward, speeds

# Sums of a few lengths near 1, and angles of them [m, rad].
ROUNDING = 1e-12
# The thesis prints its angles to six decimals [rad].
PRINTED = 5e-7
# Near a singularity rounding is divided by its sine, which the tests keep above this.
WELL = 0.05
# A direction in which the right arm can be stretched while the left one reaches, too.
DOWN_LEFT = np.array([-0.5, -np.sqrt(0.75)])


@pytest.fixture(scope="module")
def linkage() -> Linkage:
    return load_linkage("five-bar")


@pytest.fixture(scope="module")
def bar(linkage) -> FiveBar:
    return FiveBar.of(linkage)


def symmetric(half_width: float, crank: float, rod: float) -> FiveBar:
    """Return a five-bar with equal arms and its motors at (∓half_width, 0)."""
    return FiveBar(motors=[[-half_width, 0.0], [half_width, 0.0]], cranks=[crank, crank], rods=[rod, rod])


BARS = st.builds(
    symmetric,
    st.floats(0.05, 0.3),
    st.floats(0.2, 0.5),
    st.floats(0.5, 0.9),
)
UNEQUAL = st.builds(
    lambda a, b, c, d, x, y: FiveBar(motors=[[x, y], [x + 0.25, y + 0.1]], cranks=[a, b], rods=[c, d]),
    *[st.floats(0.25, 0.5)] * 2,
    *[st.floats(0.5, 0.9)] * 2,
    *[st.floats(-1, 1)] * 2,
)
MODE = st.sampled_from(sorted(MODES))
CRANKS = st.tuples(st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi))


def well_posed(bar: FiveBar, cranks: Sequence[float], assembly: Any = "below") -> tuple[np.ndarray, np.ndarray]:
    """Return tip and angles, and drop what lies near a singularity."""
    tip, angles = forward(bar, cranks, assembly)
    assume(bool(np.isfinite(tip).all()))
    assume(float(np.abs(singularity_sines(angles)).min()) > WELL)
    return tip, angles


def links_end(bar: FiveBar, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where each arm ends, link after link, as eq. (3.8) has it."""
    ways = np.stack([np.sin(angles), -np.cos(angles)], axis=-1)
    left_end = bar.motors[0] + bar.cranks[0] * ways[..., 0, :] + bar.rods[0] * ways[..., 1, :]
    right = bar.motors[1] + bar.cranks[1] * ways[..., 3, :] + bar.rods[1] * ways[..., 2, :]
    return left_end, right


# ---- inverse and forward kinematics ------------------------------------------------------------------------------


def test_thesis_start(bar: FiveBar) -> None:
    """At the start of path y1 the links stand as computed from the thesis: -1.252325, 0.369776, -0.756151, 0.711901."""
    angles = inverse(bar, [-0.15, -0.7])

    np.testing.assert_allclose(angles, (-1.252325, 0.369776, -0.756151, 0.711901), atol=PRINTED)


def test_second_goal(bar: FiveBar) -> None:
    """At Q2, in the middle, the arms mirror one another: θ1 = -θ4 = -1.375401, θ2 = -θ3 = 0.651779."""
    angles = inverse(bar, [0.0, -0.456])

    assert angles[0] == pytest.approx(-angles[3], abs=ROUNDING)
    assert angles[1] == pytest.approx(-angles[2], abs=ROUNDING)


@given(UNEQUAL, CRANKS, st.sampled_from(sorted(ASSEMBLIES)))
def test_arms_meet(bar: FiveBar, cranks: tuple[float, float], assembly: Any) -> None:
    """Both arms end in the tip, whatever their lengths and wherever the motors stand."""
    tip, angles = well_posed(bar, cranks, assembly)

    for end in links_end(bar, angles):
        np.testing.assert_allclose(end, tip, atol=ROUNDING / WELL)


@given(UNEQUAL, CRANKS, st.sampled_from(sorted(ASSEMBLIES)))
def test_one_mode_of_four_comes_back(bar: FiveBar, cranks: tuple[float, float], assembly: Any) -> None:
    """Of the four modes at a tip exactly one has the cranks where they were, and all four reach the tip."""
    tip, angles = well_posed(bar, cranks, assembly)

    angles_by_mode = inverse_all(bar, tip)

    deviations = {
        mode: np.abs(np.sin((mode_angles - angles) / 2)).max() for mode, mode_angles in angles_by_mode.items()
    }
    assert sorted(size < ROUNDING / WELL**2 for size in deviations.values()) == [False, False, False, True]
    for mode_angles in angles_by_mode.values():
        np.testing.assert_allclose(links_end(bar, mode_angles), [tip, tip], atol=ROUNDING / WELL)


@given(UNEQUAL, CRANKS)
def test_modes_are_signs(bar: FiveBar, cranks: tuple[float, float]) -> None:
    """A mode is the pair of signs of the serial measures, which no motion changes without a serial singularity."""
    tip, _ = well_posed(bar, cranks)

    for mode, angles in inverse_all(bar, tip).items():
        assert tuple(np.sign(singularity_sines(angles)[[0, 2]])) == MODES[mode]


def test_elbows_where_the_name_says(bar: FiveBar) -> None:
    """With the tip below the motors the elbows are outside, to the left, to the right or inside, as their mode says."""
    middle = bar.motors[:, 0]
    ways = {}
    for mode, angles in inverse_all(bar, [0.0, -0.8]).items():
        elbow_x = middle + bar.cranks * np.sin(angles[[0, 3]])
        # The line from a motor to the tip, at the height of the elbow.
        heights = bar.cranks * np.cos(angles[[0, 3]])
        line_x = middle * (1 - heights / 0.8)
        ways[mode] = tuple("left" if x < line else "right" for x, line in zip(elbow_x, line_x, strict=True))

    assert ways == {
        "out": ("left", "right"), "left": ("left", "left"), "right": ("right", "right"), "in": ("right", "left"),
    }  # fmt: skip


def test_assemblies_mirror(bar: FiveBar) -> None:
    """Both assemblies lie symmetric to the line through the elbows."""
    angles = inverse(bar, [[0.05, -0.6], [-0.1, -0.75]])

    below, above = (forward(bar, angles[:, [0, 3]], assembly)[0] for assembly in ("below", "above"))

    elbow = bar.motors[0] + bar.cranks[0] * np.stack([np.sin(angles[:, 0]), -np.cos(angles[:, 0])], axis=-1)
    for tip in (below, above):
        np.testing.assert_allclose(np.linalg.norm(tip - elbow, axis=-1), bar.rods[0], atol=ROUNDING)
    right = bar.motors[1] + bar.cranks[1] * np.stack([np.sin(angles[:, 3]), -np.cos(angles[:, 3])], axis=-1)
    np.testing.assert_allclose(np.sum((above - below) * (right - elbow), axis=-1), 0.0, atol=ROUNDING)


def test_batches_keep_their_axes(bar: FiveBar) -> None:
    """Leading axes come back unchanged, and a row does not depend on its neighbours."""
    tips = np.stack(np.meshgrid([-0.1, 0.0, 0.1], [-0.7, -0.5]), axis=-1)

    angles = inverse(bar, tips)

    assert angles.shape == (2, 3, 4)
    np.testing.assert_allclose(angles[1, 2], inverse(bar, tips[1, 2]), atol=ROUNDING)
    assert forward(bar, angles[..., [0, 3]])[0].shape == (2, 3, 2)


def test_law_takes_floats_and_arrays() -> None:
    """The law of an arm gives the same for a float as for an array of one."""
    scalars = arm_angles(Vec2(0.05, -0.7), 0.3, 0.65, 1.0)
    many = arm_angles(Vec2(np.array([0.05]), np.array([-0.7])), 0.3, 0.65, 1.0)

    assert (scalars.crank, scalars.rod) == pytest.approx((many.crank[0], many.rod[0]), abs=1e-15)


# ---- against the generic linkage -----------------------------------------------------------------------------------


@given(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.9, -0.36)), MODE)
def test_newton_agrees(tip: tuple[float, float], mode: Any) -> None:
    """Newton's iteration on the closure of the loops moves none of the coordinates that the closed form gives."""
    linkage = load_linkage("five-bar")
    bar = FiveBar.of(linkage)
    assume(boundary_distance(bar, tip) > 0.01)
    angles = inverse(bar, tip, mode)
    assume(abs(singularity_sines(angles)[1]) > WELL)
    q = five_bar_coordinates(linkage, angles)

    np.testing.assert_allclose(ideal.close_pins(linkage, q, tip=tip), q, atol=ROUNDING)
    np.testing.assert_allclose(ideal.pin_gaps(linkage, q), 0.0, atol=ROUNDING)


@given(CRANKS, st.tuples(*[st.floats(-2, 2)] * 2), st.tuples(*[st.floats(-40, 40)] * 2))
def test_speeds_and_accelerations_agree(
    cranks: tuple[float, float], velocity: tuple[float, float], acceleration: tuple[float, float]
) -> None:
    """Speeds and accelerations are those of the generic linkage, which knows no five-bar."""
    linkage = load_linkage("five-bar")
    bar = FiveBar.of(linkage)
    _, angles = well_posed(bar, cranks)
    q = five_bar_coordinates(linkage, angles)
    names = [str(coordinate) for coordinate in linkage.coordinates]
    links = [names.index(f"link{i}.angle") for i in range(1, 5)]

    motion = ideal.ideal_motion(linkage, q, velocity, acceleration, by_tip=True)

    # Centripetal terms grow with the square of the speeds, and those with one over the sine.
    scale = 1 + np.abs(motion.qd).max() ** 2 + np.abs(motion.qdd).max()
    np.testing.assert_allclose(speeds(bar, angles, velocity), motion.qd[links], atol=scale * ROUNDING / WELL)
    np.testing.assert_allclose(
        accelerations(bar, angles, velocity, acceleration), motion.qdd[links], atol=scale * ROUNDING / WELL
    )


def test_along_a_test_path(linkage: Linkage, bar: FiveBar) -> None:
    """All along path x3 the closed form is the motion that the simulation was prepared with."""
    task = prepare_scenario(linkage, thesis_path("x3"))
    t = np.arange(task.steps + 1) * task.h
    state = task.path.evaluate(t)

    angles = inverse(bar, state.position)

    np.testing.assert_allclose(angles, task.ideal.q[:, [0, 3, 6, 7]], atol=ROUNDING)
    np.testing.assert_allclose(speeds(bar, angles, state.velocity), task.ideal.qd[:, [0, 3, 6, 7]], atol=1e-10)


@pytest.mark.parametrize("mode", sorted(MODES))
def test_configuration_chooses_the_mode(linkage: Linkage, bar: FiveBar, mode: Any) -> None:
    """A path can be prepared in any mode: the guess chooses it, and the path keeps it."""
    path = thesis_path("y4")
    guess = five_bar_coordinates(linkage, inverse(bar, path.evaluate(0.0).position, mode))

    task = prepare_scenario(linkage, path, guess=guess)

    angles = inverse(bar, path.evaluate(path.duration).position, mode)
    np.testing.assert_allclose(
        np.sin(task.ideal.q[-1] - five_bar_coordinates(linkage, angles))[[0, 3, 6, 7]], 0, atol=1e-9
    )


# ---- singularities and workspace -----------------------------------------------------------------------------------


@given(BARS, CRANKS)
def test_jacobian_moves_the_tip(bar: FiveBar, cranks: tuple[float, float]) -> None:
    """The tip moves by the Jacobian times the rotation of the cranks, to second order."""
    _, angles = well_posed(bar, cranks)
    turn = 1e-6 * np.array([0.6, -0.8])

    there, back = (forward(bar, angles[[0, 3]] + sign * turn)[0] for sign in (1, -1))

    np.testing.assert_allclose((there - back) / 2, jacobian(bar, angles) @ turn, atol=1e-15 / WELL**5)
    np.testing.assert_allclose(
        speeds(bar, angles, jacobian(bar, angles) @ turn)[[0, 3]], turn, atol=1e-6 * ROUNDING / WELL**3
    )


def test_condition_by_hand(bar: FiveBar) -> None:
    """In the middle plane one motor alone moves the tip as the other, mirrored, and the condition is a tangent.

    The rods there are ±θ2 from the vertical, and so the tip moves along x and y as cos θ2 to sin θ2.
    """
    angles = inverse(bar, [0.0, -0.6])

    ratio = abs(np.tan(angles[1]))
    assert condition_number(bar, angles) == pytest.approx(max(ratio, 1 / ratio), rel=1e-12)


def test_condition_grows_without_bound(bar: FiveBar) -> None:
    """The condition doubles when the border is four times as near: the elbow angle is the root of the distance."""
    depths = np.array([1e-6, 4e-6])
    tips = bar.motors[1] + (0.95 - depths)[:, None] * DOWN_LEFT

    near, far = condition_number(bar, inverse(bar, tips))

    # The next term of both roots.
    assert near / far == pytest.approx(2.0, rel=1e-2)


def test_rods_in_line_are_refused(bar: FiveBar) -> None:
    """The Jacobian of rods in line is refused."""
    theta = np.arcsin(1 / 3)
    with pytest.raises(InvalidValueError, match="the rods are in one line"):
        jacobian(bar, [theta, 0.4, 0.4, -theta])


@given(UNEQUAL, st.floats(-1.6, 1.6), st.floats(-1.6, 1.6))
def test_mask_is_the_inverse(bar: FiveBar, x: float, y: float) -> None:
    """A point is inside the border exactly if the inverse kinematics has an answer for it."""
    tip = bar.motors.mean(axis=0) + np.array([x, y])
    distance = boundary_distance(bar, tip)
    assume(abs(distance) > ROUNDING)

    if distance > 0:
        assert np.all(np.isfinite(inverse(bar, tip)))
    else:
        with pytest.raises(InvalidValueError, match="out of reach"):
            inverse(bar, tip)


@given(UNEQUAL, st.floats(-1.6, 1.6), st.floats(-1.6, 1.6), st.floats(-np.pi, np.pi))
def test_distance_is_one(bar: FiveBar, x: float, y: float, way: float) -> None:
    """Nobody comes nearer to the border by more than his distance."""
    points = bar.motors.mean(axis=0) + np.array([x, y]) + 0.1 * np.outer([0, 1], [np.cos(way), np.sin(way)])

    here, there = boundary_distance(bar, points)

    assert abs(here - there) <= 0.1 + ROUNDING


def test_distance_against_the_grid(bar: FiveBar) -> None:
    """Outside, the distance is that to the nearest cell that is reached, but for half a diagonal of a cell."""
    grid = workspace(bar, 150)
    inside = np.stack(np.meshgrid(grid.x, grid.y), axis=-1)[grid.reachable]
    size = grid.x[1] - grid.x[0]
    outside = np.array([[0.0, 0.0], [-0.1, 0.0], [1.3, 0.2], [0.0, -1.4], [0.0, 0.3]])

    result = -boundary_distance(bar, outside)

    nearest = np.linalg.norm(outside[:, None] - inside, axis=-1).min(axis=1)
    np.testing.assert_allclose(result, nearest, atol=size)


def test_area_of_a_ring() -> None:
    """With both motors at nearly one point the workspace is a ring: π (0.95² - 0.35²) m²."""
    ring = workspace(symmetric(1e-9, 0.3, 0.65), 400)

    # A cell on the border counts as a whole or not at all: an error of a random half cell for each.
    area = ring.reachable.sum() * (ring.x[1] - ring.x[0]) * (ring.y[1] - ring.y[0])
    assert area == pytest.approx(np.pi * (0.95**2 - 0.35**2), rel=2e-3)


def test_borders_are_serial(bar: FiveBar) -> None:
    """On every border curve an arm is stretched or folded, and beyond it the point is out of reach."""
    curves = [curve for curve in singular_curves(bar) if curve.kind == "serial"]
    assert len(curves) >= 3
    for curve in curves:
        np.testing.assert_allclose(boundary_distance(bar, curve.points), 0.0, atol=1e-9)
        away = np.abs(np.linalg.norm(curve.points[:, None] - bar.motors, axis=-1)[..., None] - bar.reaches)
        assert np.all(away.min(axis=(1, 2)) < ROUNDING)


@pytest.mark.parametrize(
    "bar",
    [
        symmetric(0.1, 0.3, 0.65),
        symmetric(0.45, 0.3, 0.4),
        FiveBar(motors=[[-0.2, 0], [0.3, 0.1]], cranks=[0.3, 0.35], rods=[0.5, 0.3]),
    ],
    ids=["thesis", "stretching", "unequal"],
)
def test_parallel_curves(bar: FiveBar) -> None:
    """On every parallel curve, in the mode that it names, the rods are in one line."""
    curves = [curve for curve in singular_curves(bar) if curve.kind == "parallel"]
    assert curves
    for curve in curves:
        for mode in set(curve.modes.tolist()) - {""}:
            positions = curve.points[curve.modes == mode]
            good = boundary_distance(bar, positions) > 1e-4
            sines = singularity_sines(inverse(bar, positions[good], mode))[:, 1]
            np.testing.assert_allclose(sines, 0.0, atol=1e-6)


def test_thesis_rods_only_fold(bar: FiveBar) -> None:
    """The elbows of the thesis' arm come no farther apart than 0.8 m, so its rods of 1.3 m are never stretched.

    They are in one line only where the elbows fall together, at (0, ±0.2828) m: circles of 0.65 m round these.
    """
    positions = np.concatenate([curve.points for curve in singular_curves(bar) if curve.kind == "parallel"])

    height = np.sqrt(0.3**2 - 0.1**2)
    away = np.linalg.norm(positions[:, None] - [[0.0, height], [0.0, -height]], axis=-1)
    np.testing.assert_allclose(np.abs(away - 0.65).min(axis=1), 0.0, atol=ROUNDING)


# ---- what is refused -----------------------------------------------------------------------------------------------


def test_out_of_reach_says_how_far(bar: FiveBar) -> None:
    """A point out of reach is named with its row, by how much it is out, and of which arm."""
    with pytest.raises(InvalidValueError, match=r"tip 1: \(800, -600\) mm .* 131\.7 mm too far from the left motor"):
        inverse(bar, [[0.0, -0.5], [0.8, -0.6]])
    with pytest.raises(InvalidValueError, match=r"50 mm too near to the right motor, whose arm reaches 350 to 950 mm"):
        inverse(bar, [0.4, 0.0])


def test_on_a_motor() -> None:
    """On the motor of an arm of equal links the folded arm may stand anywhere, and that is said."""
    with pytest.raises(InvalidValueError, match="on the left motor"):
        inverse(symmetric(0.1, 0.4, 0.4), [-0.1, 0.0])


def test_names_and_shapes(bar: FiveBar) -> None:
    """A slip in a name is answered with the nearest; numbers in the wrong shape with the right one."""
    with pytest.raises(UnknownNameError, match="Did you mean 'right'"):
        inverse(bar, [0.0, -0.6], "rigth")  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match=r"tip: expected a shape ending in \(2,\), got \(3,\)"):
        inverse(bar, [0.0, 0.0, 0.0])
    with pytest.raises(ShapeError, match="θ1 to θ4"):
        singularity_sines([0.0, 0.0])
    with pytest.raises(InvalidValueError, match="length of a link: expected more than 0"):
        symmetric(0.1, 0.0, 0.65)
    with pytest.raises(InvalidValueError, match="never meet"):
        workspace(symmetric(1.0, 0.2, 0.3))


# ---- recognising one -----------------------------------------------------------------------------------------------


def changed(linkage: Linkage, **changes: Any) -> Linkage:
    return attrs.evolve(linkage, **changes)


def test_others_are_none() -> None:
    """A slider-crank and a four-bar are no five-bars, each for its own reason."""
    with pytest.raises(InvalidValueError, match="slider-crank is no five-bar: body slider slides along a guide"):
        FiveBar.of(load_linkage("slider-crank"))
    with pytest.raises(InvalidValueError, match="four-bar is no five-bar: it has 3 bodies besides the ground, not 4"):
        FiveBar.of(load_linkage("four-bar"))


def test_tip_drives_and_pins(linkage: Linkage) -> None:
    """Another tip, motors elsewhere, or a pin more or less make a linkage no five-bar."""
    with pytest.raises(InvalidValueError, match="its tip is link2:J2, not link2:J3"):
        FiveBar.of(changed(linkage, tip=BodyPoint("link2", "J2")))
    with pytest.raises(InvalidValueError, match="its drives move link1, not link1 and link4"):
        FiveBar.of(changed(linkage, drives=[Drive(body="link1")]))
    with pytest.raises(InvalidValueError, match="it has 4 pins, not 5"):
        FiveBar.of(changed(linkage, pins=linkage.pins[:2]))
    twice = attrs.evolve(linkage.pins[2], bearing=BodyPoint("link2", "J2"), journal=BodyPoint("link3", "J4"))
    with pytest.raises(InvalidValueError, match="body link2 has 3 pins, not 2"):
        FiveBar.of(changed(linkage, pins=[*linkage.pins[:2], twice]))


def test_any_naming_and_axes(bar: FiveBar) -> None:
    """A five-bar is one whatever its bodies are called, wherever their axes point, and whichever pins have play."""
    bodies = [
        Body(name="right arm", mass=1.0, inertia=0.01, centre=[0.0, 0.1], points={"m": [0, 0], "e": [0.18, 0.24]}),
        Body(name="left arm", mass=1.0, inertia=0.01, points={"m": [0.3, 0], "e": [0, 0]}),
        Body(name="left rod", mass=0.5, inertia=0.02, centre=[0.0, 0.3], points={"e": [0, 0], "t": [0.39, 0.52]}),
        Body(name="right rod", mass=0.5, inertia=0.02, points={"e": [0.1, 0], "t": [-0.55, 0]}),
    ]
    other = Linkage(
        name="other",
        bodies=bodies,
        ground=Body(name="ground", points={"a": [0.1, 0.0], "b": [-0.1, 0.0]}),
        joints=[
            Pin(body="right arm", point="m", on=BodyPoint("ground", "a")),
            Pin(body="left arm", point="m", on=BodyPoint("ground", "b")),
            Pin(body="left rod", point="e", on=BodyPoint("left arm", "e")),
        ],
        pins=[
            ClearancePin(name="T", bearing=BodyPoint("right rod", "t"), journal=BodyPoint("left rod", "t"),
                         clearance=1e-4, journal_radius=0.01),
            ClearancePin(name="E", bearing=BodyPoint("right arm", "e"), journal=BodyPoint("right rod", "e"),
                         clearance=1e-4, journal_radius=0.01),
        ],
        drives=[Drive(body="right arm"), Drive(body="left arm")],
        tip=BodyPoint("left rod", "t"),
    )  # fmt: skip

    recognised = FiveBar.of(other)

    for name in ("motors", "cranks", "rods"):
        np.testing.assert_allclose(getattr(recognised, name), getattr(bar, name), atol=ROUNDING)
    tip = np.array([-0.12, -0.63])
    q = five_bar_coordinates(other, inverse(recognised, tip, "left"))
    np.testing.assert_allclose(ideal.pin_gaps(other, q), 0.0, atol=ROUNDING)
    np.testing.assert_allclose(ideal.tip_position(other, q), tip, atol=ROUNDING)


def test_guide_in_the_loop(linkage: Linkage) -> None:
    """Four bodies of which one slides are no five-bar either."""
    slide = Guide(body="link4", point="J5", on=BodyPoint("ground", "J5"))
    with pytest.raises(InvalidValueError, match="body link4 slides along a guide"):
        FiveBar.of(changed(linkage, joints=[linkage.joints[0], slide]))
