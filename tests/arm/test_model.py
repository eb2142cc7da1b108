"""The model of an arm: it never changes, and refuses what no arm can be."""

import copy
import math
import pickle
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.payloads import payload
from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.spatial.shapes import Box
from oracles.arms import random_arm
from oracles.catalogue import FEW, NAMES


def arrays_of(thing: Any) -> list[np.ndarray]:
    if isinstance(thing, np.ndarray):
        return [thing]
    if isinstance(thing, tuple):
        return [array for part in thing for array in arrays_of(part)]
    return (
        [array for field in attrs.fields(type(thing)) for array in arrays_of(getattr(thing, field.name))]
        if (attrs.has(type(thing)))
        else []
    )


def parts_of(arm: Arm) -> list[object]:
    return [*arm.joints, *arm.links, *arm.motors]


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_arrays_cannot_be_written(name: str) -> None:
    """No number of a loaded arm can be changed: not in its poses, gravity, centres of mass, tensors or coupling."""
    arm = load_arm(name)
    arrays = arrays_of(arm)

    solids = [*arm.base_solids, *(solid for link in arm.links for solid in link.solids)]
    of_solids = sum(2 if isinstance(solid.shape, Box) else 1 for solid in solids)
    assert len(arrays) == 3 + 2 * arm.n + of_solids + (arm.coupling is not None)
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 9


def test_what_was_handed_in_stays_the_callers() -> None:
    """An arm copies the arrays it is built from: changing them later does not change the arm."""
    com, gravity = np.zeros(3), np.array((0.0, 0.0, -1.0))
    arm = Arm(name="one", joints=[Joint(kind="revolute")], links=[Link(mass=1, com=com)], gravity=gravity)

    com[0], gravity[2] = 7, 7

    assert arm.links[0].com[0] == 0
    assert arm.gravity[2] == -1


def test_attributes_cannot_be_set(rng: np.random.Generator) -> None:
    """An arm and all its parts are frozen, and nothing can be added to them."""
    arm = random_arm(rng, 2)

    for thing in (arm, arm.joints[0], arm.joints[0].limits, arm.links[0], arm.motors[0]):
        for field in attrs.fields(type(thing)):
            with pytest.raises(attrs.exceptions.FrozenInstanceError):
                setattr(thing, field.name, None)
        with pytest.raises(attrs.exceptions.FrozenInstanceError):
            thing.extra = 1


def test_equal_arms(rng: np.random.Generator) -> None:
    """Two arms are equal when all their numbers are."""
    arm = random_arm(rng, 3)

    assert load_arm("puma560") == load_arm("puma560")
    assert attrs.evolve(arm) == arm
    assert attrs.evolve(arm, gravity=-arm.gravity) != arm
    heavier = attrs.evolve(arm.links[2], mass=arm.links[2].mass + 1)
    assert attrs.evolve(arm, links=[*arm.links[:2], heavier]) != arm


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_equal_arms_hash_equal(name: str) -> None:
    """An arm is a key: one that is read again finds what was kept for the first, a heavier one does not."""
    arm, again = load_arm(name), load_arm(name)
    heavier = attrs.evolve(arm, links=[*arm.links[:-1], attrs.evolve(arm.links[-1], mass=arm.links[-1].mass + 1)])
    asked = []

    @lru_cache
    def answer(one: Arm) -> int:
        asked.append(one)
        return one.n

    assert {arm: "kept"}[again] == "kept"
    assert heavier not in {arm: "kept"}
    assert (answer(arm), answer(again), answer(heavier)) == (arm.n,) * 3
    assert asked == [arm, heavier]
    for part, same in zip(
        (*arm.joints, *arm.links, *arm.motors), (*again.joints, *again.links, *again.motors), strict=True
    ):
        assert hash(part) == hash(same)


def test_nought_has_no_sign() -> None:
    """0 and -0 are one number: arms that differ in nothing else are equal and hash equal."""
    plus, minus = (Arm(name="one", joints=ONE, gravity=[zero, zero, -9.8]) for zero in (0.0, -0.0))

    assert plus == minus
    assert hash(plus) == hash(minus)
    assert Link(com=[0.0, 0.0, 1.0]) == Link(com=[-0.0, 0.0, 1.0])


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda arm: pickle.loads(pickle.dumps(arm))])
def test_copies(copied: Callable[[Any], Any], rng: np.random.Generator) -> None:
    """A copy, in this process or another one, is equal to the arm, hashes equal, and cannot be changed either."""
    for arm in (load_arm("puma560"), random_arm(rng, 3)):
        hash(arm)  # what is kept of it must not go with the copy

        twin = copied(arm)

        assert twin == arm
        assert hash(twin) == hash(arm)
        assert all(not array.flags.writeable for array in arrays_of(twin))


def test_shown_in_a_line() -> None:
    """An arm shows itself by name, number and kinds of its joints, and not by its tables."""
    assert repr(load_arm("stanford")) == "<Arm 'stanford': 6 joints, RRPRRR>"
    assert repr(Arm(name="one", joints=ONE)) == "<Arm 'one': 1 joint, R>"


def test_numbers_of_any_kind() -> None:
    """Whole numbers, fractions and NumPy's numbers are made plain numbers."""
    joint = Joint(kind="revolute", d=1, a=np.float32(0.5), theta=Fraction(1, 4), limits=Limits(upper=np.int64(3)))

    assert [type(x) for x in (joint.d, joint.a, joint.theta, joint.limits.upper)] == [float] * 4
    assert joint == Joint(kind="revolute", d=1.0, a=0.5, theta=0.25, limits=Limits(upper=3.0))


def test_an_arm_of_geometry_alone() -> None:
    """Without links and drives an arm has massless ones, hangs upright and is limited by nothing."""
    arm = Arm(name="bare", joints=(Joint(kind="revolute") for _ in range(2)))

    assert arm.n == 2
    assert [link.mass for link in arm.links] == [0, 0]
    assert [motor.inertia for motor in arm.motors] == [0, 0]
    np.testing.assert_array_equal(arm.gravity, (0, 0, -STANDARD_GRAVITY))
    np.testing.assert_array_equal(arm.limits.lower, (-math.inf, -math.inf))
    np.testing.assert_array_equal(arm.limits.effort, (math.inf, math.inf))


@pytest.mark.parametrize("turns", range(-4, 5))
def test_right_angles_are_exact(turns: int) -> None:
    """The cosine of a whole number of right angles is 0, 1 or -1, not nearly so."""
    assert exact_cosine(turns * math.pi / 2) == (1, 0, -1, 0)[turns % 4]
    angle = math.radians(90 * turns)
    assert {exact_cosine(angle), exact_sine(angle)} <= {0.0, 1.0, -1.0}
    assert (exact_cosine(1e-3), exact_sine(1e-3)) == (math.cos(1e-3), math.sin(1e-3))


def test_angles_of_many_turns() -> None:
    """However large an angle is, its sine and cosine belong together."""
    for angle in (1e6, -1e12, 1e50):
        assert exact_cosine(angle) ** 2 + exact_sine(angle) ** 2 == pytest.approx(1, rel=1e-15)


ONE = [Joint(kind="revolute")]
ASYMMETRIC = np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])
REFUSED = {
    "limits reversed": (lambda: Limits(lower=1, upper=-1), "limits: lower 1 must be below upper -1"),
    "limits that leave no room": (lambda: Limits(lower=1, upper=1), "limits: lower 1 must be below upper 1"),
    "a limit that is no number": (lambda: Limits(lower=math.nan), "limits: lower nan must be below upper inf"),
    "no speed": (lambda: Limits(speed=0), "limits: speed must be above 0, got 0"),
    "negative effort": (lambda: Limits(effort=-1), "limits: effort must be above 0, got -1"),
    "acceleration that is no number": (lambda: Limits(acceleration=math.nan), "acceleration must be above 0, got nan"),
    "a kind of joint that there is not": (
        lambda: Joint(kind="helical"),  # type: ignore[arg-type]
        "joint: expected kind revolute or prismatic, got 'helical'",
    ),
    "a length that is no number": (lambda: Joint(kind="revolute", a=math.nan), "joint: a must be finite, got nan"),
    "an endless length": (lambda: Joint(kind="revolute", d=math.inf), "joint: d must be finite, got inf"),
    "negative mass": (lambda: Link(mass=-1), "link: mass must be 0 or more, got -1"),
    "mass that is no number": (lambda: Link(mass=math.nan), "link: mass must be 0 or more, got nan"),
    "endless mass": (lambda: Link(mass=math.inf), "link: mass must be 0 or more, got inf"),
    "asymmetric tensor": (lambda: Link(inertia=ASYMMETRIC), "inertia: expected a symmetric tensor"),
    "a moment above the two others together": (
        lambda: Link(mass=2, inertia=np.diag([1, 1, 3])),
        (
            "link of 2 kg with the inertia [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]: a body cannot have the "
            "principal moments 1, 1, 3 kg m² about its centre of mass: none may be negative, or exceed the sum of the "
            "other two. Specify the tensor about the centre of mass"
        ),
    ),
    "a moment below none": (
        lambda: Link(mass=2, inertia=[[1, 2, 0], [2, 1, 0], [0, 0, 1]]),
        "a body cannot have the principal moments -1, 1, 3 kg m² about its centre of mass",
    ),
    "a tensor beyond measure": (lambda: Link(inertia=1e200 * np.eye(3)), "inertia: expected numbers no larger than"),
    "mass beyond measure": (lambda: Link(mass=1e200), "link: mass must not be larger than 1e+100, got 1e+200"),
    "mass in words": (lambda: Link(mass="2 kg"), "link: mass: expected a number, got '2 kg'"),  # type: ignore[arg-type]
    "a joint in words": (
        lambda: Arm(name="one", joints=["revolute"]),  # type: ignore[list-item]
        "joints: expected each to be a Joint, got 'revolute' as number 1",
    ),
    "one joint, and no list of it": (
        lambda: Arm(name="one", joints=ONE[0]),  # type: ignore[arg-type]
        "joints: expected a list of Joint, got Joint(kind='revolute'",
    ),
    "limits in numbers": (
        lambda: Joint(kind="revolute", limits=(-1, 1)),  # type: ignore[arg-type]
        "joint: expected limits to be Limits, got (-1, 1)",
    ),
    "a hand that reaches nowhere": (
        lambda: Arm(name="one", joints=ONE, reach=0),
        "arm 'one': reach must be above 0, got 0",
    ),
    "a tensor of two axes": (
        lambda: Link(inertia=np.eye(2)),
        r"inertia: expected a shape ending in (3, 3), got (2, 2)",
    ),
    "a centre of mass in a plane": (lambda: Link(com=[0, 0]), "com: expected a shape ending in (3,), got (2,)"),
    "a centre of mass nowhere": (
        lambda: Link(com=[0, 0, math.nan]),
        "com: every number must be finite, got nan at (2,)",
    ),
    "a motor that pushes itself": (lambda: Motor(viscous=-0.1), "motor: viscous must be 0 or more, got -0.1"),
    "an endless rotor": (lambda: Motor(inertia=math.inf), "motor: inertia must be 0 or more, got inf"),
    "no joints": (lambda: Arm(name="none", joints=[]), "arm 'none': expected at least one joint"),
    "two motors for one joint": (
        lambda: Arm(name="one", joints=ONE, motors=[Motor(), Motor()]),
        "arm 'one': 1 joints but 2 motors",
    ),
    "no link for one joint": (lambda: Arm(name="one", joints=ONE, links=[]), "arm 'one': 1 joints but 0 links"),
    "a base that is no pose": (
        lambda: Arm(name="one", joints=ONE, base=2 * np.eye(4)),
        "base: expected a homogeneous transformation",
    ),
    "a tool of three rows": (
        lambda: Arm(name="one", joints=ONE, tool=np.eye(4)[:3]),
        "tool: expected a shape ending in (4, 4), got (3, 4)",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_no_arm_can_be(what: str) -> None:
    """What cannot be is refused when the arm is built, and the message says what and what was got."""
    build, message = REFUSED[what]

    with pytest.raises((InvalidValueError, KindError, ShapeError)) as caught:
        build()

    assert message in str(caught.value)


def test_moments_that_are_not_known() -> None:
    """A single known moment is let pass, and so is a tensor whose other moments are said not to be known."""
    assert Link(inertia=np.diag([0, 0, 0.35])).complete
    assert not Link(mass=1, inertia=np.diag([0.1, 0.1, 0.35]), complete=False).complete


def test_load_on_a_hand_of_one_moment() -> None:
    """A hand of which one moment is known carries a load; the sum of the two need not be a tensor that a body has."""
    hand = Arm(name="wheel", joints=ONE, links=[Link(mass=1, inertia=np.diag([0, 0, 0.35]))])

    loaded = payload(hand, 1.0, (0, 0, 0), 0.01 * np.eye(3))

    np.testing.assert_allclose(loaded.links[0].inertia, np.diag([0.01, 0.01, 0.36]), atol=1e-15)
    assert pickle.loads(pickle.dumps(loaded)) == loaded


def test_massless_parts() -> None:
    """A part that weighs nothing is a part: a joint between two links, a rod in a sketch."""
    assert Link(mass=0).mass == 0
    assert Arm(name="one", joints=ONE, links=[Link(mass=0)]).links == (Link(),)


def test_limits_of_all_joints() -> None:
    """The limits of all joints are one array each, made once, which nobody can write to, in copies too."""
    arm = load_arm("puma560")

    assert arm.limits is arm.limits
    np.testing.assert_array_equal(arm.limits.speed, [joint.limits.speed for joint in arm.joints])
    for limits in (arm.limits, pickle.loads(pickle.dumps(arm)).limits, attrs.evolve(arm, name="another").limits):
        np.testing.assert_array_equal(limits.lower, arm.limits.lower)
        with pytest.raises(ValueError, match="read-only"):
            limits.lower[0] = 0.0


@pytest.mark.parametrize("name", ["theta", "alpha"])
def test_fixed_angles_that_have_no_sine(name: str) -> None:
    """A fixed angle is no larger than a position may be: of a larger one no digit of the sine is right."""
    with pytest.raises(InvalidValueError, match=rf"joint: {name} must not be larger than 1e\+12, got 1e\+15"):
        Joint(kind="revolute", **{name: 1e15})
