"""How far the resting tip moves by every dimension: published digits, and differences of full equilibria."""

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance.dimensions import deviate, dimensions_of
from armwright.clearance.estimation.static_estimate import rest_matrix
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Load, Pin
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import assembly_guess
from armwright.clearance.sensitivities import rest_sensitivities
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError, UnknownNameError
from samples import Sample

# The goals of the thesis [m].
GOALS = ((-0.18, -0.6), (0.0, -0.575), (0.18, -0.6))
# Derivatives of the tip there by the lengths of the links, and by the zeros of the motors [m/rad], from the spec.
BY_LENGTHS = (
    ((-0.2467, 0.6586, -0.9942, 0.1889), (0.3094, -0.8259, -0.3572, 0.0679)),
    ((-0.3633, 0.8243, -0.8243, 0.3633), (0.2772, -0.6289, -0.6289, 0.2772)),
    ((-0.1889, 0.9942, -0.6586, 0.2467), (0.0679, -0.3572, -0.8259, 0.3094)),
)
BY_ZEROS = (
    ((0.1832, 0.2928), (-0.2297, 0.1052)),
    ((0.2220, 0.2220), (-0.1694, 0.1694)),
    ((0.2928, 0.1832), (-0.1052, 0.2297)),
)
PRINTED = 5.1e-5
# Steps of the differences, and what the derivatives differ by from them: by rounding in the equilibria, and by the
# third derivatives.
STEPS: Mapping[str, float] = {"m": 5e-7, "rad": 5e-7, "kg": 1e-2, "N": 1e-2}
CLOSE = 1e-6


@pytest.fixture(scope="module")
def linkage() -> Linkage:
    return load_linkage("five-bar")


def test_spec(linkage: Linkage) -> None:
    """The five-bar at the thesis' goals: lengths and zeros as printed, clearances as the estimate at rest has them."""
    q = closed_at_tips(linkage, GOALS)

    found = rest_sensitivities(linkage, q, np.zeros(3))

    np.testing.assert_allclose(found.tip, GOALS, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.of("length"), BY_LENGTHS, rtol=0, atol=PRINTED)
    np.testing.assert_allclose(found.of("zero"), BY_ZEROS, rtol=0, atol=PRINTED)
    np.testing.assert_allclose(found.of("clearance"), rest_matrix(linkage, q), rtol=0, atol=1e-12)


def test_play_and_length_look_alike(linkage: Linkage) -> None:
    """Play of J2 moves the tip nearly as the length of link 2 does, and play of J4 as that of link 3."""
    found = rest_sensitivities(linkage, closed_at_tips(linkage, GOALS[:1]), np.zeros(3))

    for play, length in (("J2.clearance", "link2.length"), ("J4.clearance", "link3.length")):
        b, d = found.column(play)[0], found.column(length)[0]
        assert abs(b @ d) / (np.linalg.norm(b) * np.linalg.norm(d)) > np.cos(np.radians(3))


def slotted_lever() -> Linkage:
    """A crank whose pin runs in a block, which slides along a lever."""
    return Linkage(
        name="slotted lever",
        ground=Body(name="ground", points={"O": (0, 0), "Q": (0, -0.3)}),
        bodies=[
            Body(name="crank", mass=1.0, inertia=0.01, centre=(0.05, 0), points={"O": (0, 0), "A": (0.1, 0)}),
            Body(name="lever", mass=2.0, inertia=0.05, centre=(0.2, 0.01), points={"Q": (0, 0), "T": (0.5, 0.02)}),
            Body(name="block", mass=0.5, inertia=0.001, points={"A": (0, 0), "E": (0.01, 0.02)}),
        ],
        joints=[
            Pin(body="crank", point="O", on=BodyPoint("ground", "O")),
            Pin(body="lever", point="Q", on=BodyPoint("ground", "Q")),
            Guide(body="block", point="E", on=BodyPoint("lever", "T"), direction=0.1, angle=0.3),
        ],
        pins=[
            ClearancePin(
                name="P",
                bearing=BodyPoint("block", "A"),
                journal=BodyPoint("crank", "A"),
                clearance=2e-4,
                journal_radius=0.01,
            )
        ],
        drives=[Drive(body="crank")],
        loads=[Load(point=BodyPoint("lever", "T"), force=(20, -10))],
        tip=BodyPoint("lever", "T"),
        assembly={"crank": 0.5, "lever": 1.5, "block": -0.2},
    )


def two_links() -> Linkage:
    """An arm of two links with a motor in each joint, and no play."""
    link = Body(name="upper", mass=1.0, inertia=0.01, points={"a": (0, 0), "b": (0.4, 0)})
    return Linkage(
        name="two links",
        ground=Body(name="ground", points={"O": (0, 0)}),
        bodies=[link, attrs.evolve(link, name="lower")],
        joints=[
            Pin(body="upper", point="a", on=BodyPoint("ground", "O")),
            Pin(body="lower", point="a", on=BodyPoint("upper", "b")),
        ],
        pins=[],
        drives=[Drive(body="upper"), Drive(body="lower")],
        tip=BodyPoint("lower", "b"),
    )


def varied(linkage: Linkage, rng: np.random.Generator) -> Linkage:
    """The same with other points, masses, guides, clearances, and one more load."""
    size = max(float(np.abs(list(body.points.values())).max()) for body in linkage.bodies)

    def other(body: Body) -> Body:
        points = {name: x + rng.normal(scale=0.03 * size, size=2) for name, x in body.points.items()}
        mass = body.mass * rng.uniform(0.7, 1.4)
        return attrs.evolve(body, points=points, mass=mass, centre=body.centre + rng.normal(scale=0.02 * size, size=2))

    weight = 10 * sum(body.mass for body in linkage.bodies)
    return attrs.evolve(
        linkage,
        ground=other(linkage.ground),
        bodies=[other(body) for body in linkage.bodies],
        joints=[
            attrs.evolve(joint, direction=joint.direction + rng.normal(scale=0.1))
            if isinstance(joint, Guide)
            else joint
            for joint in linkage.joints
        ],
        pins=[attrs.evolve(pin, clearance=rng.uniform(0.5e-4, 3e-4)) for pin in linkage.pins],
        loads=[*linkage.loads, Load(point=linkage.tip, force=rng.normal(scale=weight, size=2))],
    )


def changed(linkage: Linkage, name: str, step: float) -> Linkage:
    """The linkage with another value of a dimension other than the zero of a drive."""
    owner, _, what = name.rpartition(".")
    way = step * np.array((what in {"along", "x"}, what in {"across", "y"}))
    if what == "clearance":
        return linkage.with_clearances({owner: linkage.clearances[owner] + step})
    if ":" in owner:
        return moved(linkage, *owner.split(":"), way)
    if owner == "tool":
        tip = linkage.body(linkage.tip.body)
        own = with_body(linkage, attrs.evolve(tip, points={**tip.points, "tool": linkage.point(linkage.tip) + way}))
        return attrs.evolve(own, tip=BodyPoint(tip.name, "tool"))
    if what in {"x", "y"}:
        i = int(owner.removeprefix("load")) - 1
        return attrs.evolve(linkage, loads=replaced(linkage.loads, i, force=linkage.loads[i].force + way))
    if what in {"direction", "angle"}:
        i = next(i for i, joint in enumerate(linkage.joints) if joint.body == owner)
        value = getattr(linkage.joints[i], what) + step
        return attrs.evolve(linkage, joints=replaced(linkage.joints, i, **{what: value}))
    return with_body_changed(linkage, owner, what, step)


def with_body_changed(linkage: Linkage, name: str, what: str, step: float) -> Linkage:
    body, joint = linkage.body(name), linkage.joint(name)
    if what == "mass":
        return with_body(linkage, attrs.evolve(body, mass=body.mass + step))
    ends = [point for point in body.points if joint is None or point != joint.point]
    held = joint.point if joint else ends.pop(0)
    way = body.points[ends[0]] - body.points[held]
    return moved(linkage, name, ends[0], step * way / np.linalg.norm(way))


def replaced(parts: tuple[Any, ...], number: int, **values: Any) -> list[Any]:
    return [attrs.evolve(part, **values) if i == number else part for i, part in enumerate(parts)]


def with_body(linkage: Linkage, new: Body) -> Linkage:
    if new.name == "ground":
        return attrs.evolve(linkage, ground=new)
    return attrs.evolve(linkage, bodies=[new if body.name == new.name else body for body in linkage.bodies])


def moved(linkage: Linkage, body: str, point: str, by: Array) -> Linkage:
    own = linkage.body(body)
    return with_body(linkage, attrs.evolve(own, points={**own.points, point: own.points[point] + by}))


def resting_tip(linkage: Linkage, q: Array, drives: Array, stiffness: Array | None) -> Array:
    start = close_pins(linkage, q, drives=drives)
    return find_static_equilibrium(linkage, start, stiffness=stiffness).tip


LINKAGES = {
    "five-bar": load_linkage("five-bar"),
    "four-bar": load_linkage("four-bar"),
    "slider-crank": load_linkage("slider-crank"),
    "slotted lever": slotted_lever(),
}


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("name", LINKAGES)
def test_differences_of_equilibria(name: str, sample: Sample) -> None:
    """Every column of random linkages, with rigid and with soft walls, is the slope of full equilibria."""
    worst = 0.0
    for rng in sample.cases(10):
        linkage = varied(LINKAGES[name], rng)
        q = close_pins(linkage, assembly_guess(linkage), drives=assembly_guess(linkage)[list(linkage.driven)])
        drives = q[list(linkage.driven)] + rng.uniform(-0.2, 0.2, len(linkage.drives))
        q = close_pins(linkage, q, drives=drives)
        c = np.array(list(linkage.clearances.values()))
        K = contact_stiffness(linkage, c) if rng.random() < 0.5 else None

        found = rest_sensitivities(linkage, q, stiffness=K)

        assert len(set(found.names)) == len(found.names) == found.jacobian.shape[-1]
        for dimension in found.dimensions:
            step = STEPS[dimension.unit]
            tips = []
            for way in (step, -step):
                if dimension.kind == "zero":
                    at = np.array([drive.body == dimension.name.partition(".")[0] for drive in linkage.drives])
                    tips.append(resting_tip(linkage, q, drives + way * at, K))
                else:
                    tips.append(resting_tip(changed(linkage, dimension.name, way), q, drives, K))
            slope = (tips[0] - tips[1]) / (2 * step)
            off = float(np.abs(found.column(dimension.name) - slope).max()) / max(1.0, float(np.abs(slope).max()))
            worst = max(worst, off)
            assert off < CLOSE, (dimension, found.column(dimension.name), slope)
    sample.record(f"derivatives of the tip of {name}", sample.count(10), 0, worst=worst)


def test_driven_carrier() -> None:
    """The zero of a motor that carries another moves the whole arm, and that of the other the lower link alone."""
    arm = two_links()
    q = np.array([[0.3, 1.1], [-0.5, 2.0]])

    found = rest_sensitivities(arm, q)

    tip = tip_position(arm, q)
    elbow = 0.4 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=-1)
    for name, lever in (("upper.zero", tip), ("lower.zero", tip - elbow)):
        np.testing.assert_allclose(found.column(name), np.stack([-lever[:, 1], lever[:, 0]], axis=-1), atol=1e-12)
    np.testing.assert_allclose(found.column("upper.length"), elbow / 0.4, atol=1e-12)


def test_batches(linkage: Linkage, rng: np.random.Generator) -> None:
    """Many clearances at many poses make a table of derivatives, each as it is alone."""
    q = closed_at_tips(linkage, GOALS[:2])
    c = rng.uniform(1e-4, 5e-4, (3, 1, 3))

    found = rest_sensitivities(linkage, q, c)

    assert found.tip.shape == (3, 2, 2)
    assert found.jacobian.shape == (3, 2, 2, len(dimensions_of(linkage)))
    alone = rest_sensitivities(linkage, q[1], c[2, 0])
    np.testing.assert_allclose(alone.jacobian, found.jacobian[2, 1], rtol=1e-9, atol=1e-12)


def test_refusals(linkage: Linkage) -> None:
    """No such dimension; no force in the pins."""
    q = closed_at_tips(linkage, GOALS[:1])
    with pytest.raises(UnknownNameError, match=r"link2\.length"):
        rest_sensitivities(linkage, q).column("link2.lenght")
    with pytest.raises(InvalidValueError, match="pin J2 of five-bar carries no force at rest"):
        rest_sensitivities(attrs.evolve(linkage, gravity=(0.0, 0.0), loads=()), q)


def test_deviations(sample: Sample) -> None:
    """A linkage of which every dimension deviates by a little rests where the derivatives say."""
    linkage = slotted_lever()
    start = assembly_guess(linkage)
    q = close_pins(linkage, start, drives=start[list(linkage.driven)])
    rest = rest_sensitivities(linkage, q)
    for rng in sample.cases(20):
        by = rng.normal(scale=1e-7, size=len(rest.names))

        other, shifts = deviate(linkage, dict(zip(rest.names, by, strict=True)))

        tip = resting_tip(other, q, q[list(linkage.driven)] + shifts, None)
        np.testing.assert_allclose(tip - rest.tip, rest.jacobian @ by, rtol=0, atol=2e-12)
    with pytest.raises(UnknownNameError, match=r"Did you mean 'P\.clearance'"):
        deviate(linkage, {"P.clearence": 1e-6})
