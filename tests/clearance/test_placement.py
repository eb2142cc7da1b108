"""Where the points of a linkage are, and how they move, against complex numbers and differences in time."""

import cmath

import numpy as np
import pytest

from armwright.clearance.linkage import BodyPoint, Linkage
from armwright.clearance.placement import Placement, Point, Vec2
from armwright.clearance.reader import load_linkage
from clearance.trees import tree

ROUNDING = 1e-12
# Central differences over 1e-5 s, of speeds around 1.
DIFFERENCE = 1e-8
POINTS = [BodyPoint(body, "c") for body in ("arm", "sledge", "lever", "finger", "bolt", "loose")]


def by_hand(linkage: Linkage, q: np.ndarray) -> dict[str, complex]:
    """Where the point c of each body is: rotations are factors e^{iθ}, shifts are sums."""

    def z(pair: np.ndarray) -> complex:
        return complex(*pair)

    zero = linkage.zero
    b = {body.name: body for body in linkage.bodies}
    joints = {joint.body: joint for joint in linkage.joints}
    angle, origin = {}, {}
    angle["arm"] = q[0] + zero
    origin["arm"] = z(linkage.ground.points["O"]) - cmath.exp(1j * angle["arm"]) * z(b["arm"].points["a"])
    for name, on, number in (
        ("sledge", "arm", 1),
        ("lever", "sledge", 2),
        ("finger", "lever", 3),
        ("bolt", "finger", 4),
    ):
        position = origin[on] + cmath.exp(1j * angle[on]) * z(b[on].points["b"])
        if name in ("sledge", "bolt"):
            position += q[number] * cmath.exp(1j * (angle[on] + joints[name].direction))
            angle[name] = angle[on] + joints[name].angle
        else:
            angle[name] = q[number] + zero
        origin[name] = position - cmath.exp(1j * angle[name]) * z(b[name].points["a"])
    angle["loose"] = q[7] + zero
    origin["loose"] = complex(q[5], q[6]) - cmath.exp(1j * angle["loose"]) * z(b["loose"].centre)
    return {name: origin[name] + cmath.exp(1j * angle[name]) * z(b[name].points["c"]) for name in b}


def points(linkage: Linkage, q: np.ndarray, qd: np.ndarray) -> list[Point]:
    placed = Placement(linkage, list(q), list(qd))
    return [placed.point(body_point) for body_point in POINTS]


@pytest.mark.parametrize("seed", range(5))
class TestTree:
    """Pins on guides on pins, and a free body."""

    def test_places(self, seed: int) -> None:
        """Every point is where complex numbers put it."""
        rng = np.random.default_rng(seed)
        linkage = tree(rng)
        q = rng.uniform(-3, 3, 8)

        expected = by_hand(linkage, q)
        for body_point, point in zip(POINTS, points(linkage, q, 0 * q), strict=True):
            assert complex(*point.position) == pytest.approx(expected[body_point.body], abs=ROUNDING)

    def test_velocities(self, seed: int) -> None:
        """A point's velocity is the change of its position in time, and its partial derivatives times the speeds."""
        rng = np.random.default_rng(seed)
        linkage, dt = tree(rng), 1e-5
        q, qd = rng.uniform(-1, 1, (2, 8))

        now = points(linkage, q, qd)
        later, sooner = (points(linkage, q + s * dt * qd, qd) for s in (1, -1))
        for point, after, before in zip(now, later, sooner, strict=True):
            np.testing.assert_allclose(
                point.velocity,
                (np.array(after.position) - np.array(before.position)) / (2 * dt),
                rtol=0,
                atol=DIFFERENCE,
            )
            summed = sum(np.array(partial) * qd[i] for i, partial in point.partials.items())
            np.testing.assert_allclose(summed, point.velocity, rtol=0, atol=ROUNDING)

    def test_bias(self, seed: int) -> None:
        """While no speed changes a point's acceleration is its bias: turning, and Coriolis' on what slides."""
        rng = np.random.default_rng(seed)
        linkage, dt = tree(rng), 1e-5
        q, qd = rng.uniform(-1, 1, (2, 8))

        now = points(linkage, q, qd)
        later, sooner = (points(linkage, q + s * dt * qd, qd) for s in (1, -1))
        for point, after, before in zip(now, later, sooner, strict=True):
            slope = (np.array(after.velocity) - np.array(before.velocity)) / (2 * dt)
            np.testing.assert_allclose(point.bias, slope, rtol=0, atol=DIFFERENCE)


def test_hanging_crank() -> None:
    """At angle 0 the thesis' crank hangs down from its motor; at 90 degrees it points to the right."""
    linkage = load_linkage("five-bar")
    body_point = BodyPoint("link1", "J2")

    down = Placement(linkage, [0.0] * 8, [0.0] * 8).point(body_point)
    right = Placement(linkage, [np.pi / 2] + [0.0] * 7, [2.0] + [0.0] * 7).point(body_point)

    assert down.position == pytest.approx((-0.1, -0.3), abs=ROUNDING)
    assert right.position == pytest.approx((0.2, 0.0), abs=ROUNDING)
    assert right.velocity == pytest.approx((0.0, 0.6), abs=ROUNDING)
    assert right.bias == pytest.approx((-1.2, 0.0), abs=ROUNDING)


def test_ground_stands_still() -> None:
    """A point of the ground moves with nothing."""
    point = Placement(load_linkage("five-bar"), [1.0] * 8, [1.0] * 8).point(BodyPoint("ground", "J1"))

    assert point.partials == {}
    assert point.velocity == point.bias == (0.0, 0.0)


def test_pairs() -> None:
    """Vectors of the plane add, and rotate to the left."""
    a, b = Vec2(1.0, 2.0), Vec2(-3.0, 0.5)

    assert a.plus(b) == (-2.0, 2.5)
    assert a.minus(b) == (4.0, 1.5)
    assert a.times(2.0) == (2.0, 4.0)
    assert a.dot(b) == -2.0
    assert a.perpendicular() == (-2.0, 1.0)
    assert a.dot(a.perpendicular()) == 0.0
