"""The model of an arm: it never changes, and refuses what no arm can be."""

import math
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arm.load import arm_names, load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Limits, Link, Motor, exact_cosine, exact_sine
from armwright.errors import InvalidValueError, ShapeError
from oracles.arms import random_arm


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


@pytest.mark.parametrize("name", arm_names())
def test_arrays_cannot_be_written(name: str) -> None:
    """No number of an arm that was loaded can be changed: not in its poses, gravity, centres of mass or tensors."""
    arm = load_arm(name)
    arrays = arrays_of(arm)

    assert len(arrays) == 3 + 2 * arm.n
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


def test_an_arm_of_geometry_alone() -> None:
    """Without links and drives an arm has massless ones, hangs upright and is limited by nothing."""
    arm = Arm(name="bare", joints=(Joint(kind="revolute") for _ in range(2)))

    assert arm.n == 2
    assert [link.mass for link in arm.links] == [0, 0]
    assert [motor.inertia for motor in arm.motors] == [0, 0]
    np.testing.assert_array_equal(arm.gravity, (0, 0, -STANDARD_GRAVITY))
    np.testing.assert_array_equal(arm.limit("lower"), (-math.inf, -math.inf))
    np.testing.assert_array_equal(arm.limit("effort"), (math.inf, math.inf))


@pytest.mark.parametrize("turns", range(-4, 5))
def test_right_angles_are_exact(turns: int) -> None:
    """The cosine of a whole number of right angles is 0, 1 or -1, not nearly so."""
    assert exact_cosine(turns * math.pi / 2) == (1, 0, -1, 0)[turns % 4]
    joint = Joint(kind="revolute", alpha=math.radians(90 * turns), theta=math.radians(90 * turns))
    assert {joint.cos_alpha, joint.sin_alpha, joint.cos_theta, joint.sin_theta} <= {0.0, 1.0, -1.0}
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
    "a tensor of two axes": (
        lambda: Link(inertia=np.eye(2)),
        r"inertia: expected a shape ending in (3, 3), got (2, 2)",
    ),
    "a centre of mass in a plane": (lambda: Link(com=[0, 0]), "vector: expected a shape ending in (3,), got (2,)"),
    "a centre of mass nowhere": (lambda: Link(com=[0, 0, math.nan]), "vector: every number must be finite, got nan"),
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
        "pose: expected a rotation, a place and the row 0 0 0 1",
    ),
    "a tool of three rows": (
        lambda: Arm(name="one", joints=ONE, tool=np.eye(4)[:3]),
        "pose: expected a shape ending in (4, 4), got (3, 4)",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_no_arm_can_be(what: str) -> None:
    """What cannot be is refused when the arm is built, and the message says what and what was got."""
    build, message = REFUSED[what]

    with pytest.raises((InvalidValueError, ShapeError)) as caught:
        build()

    assert message in str(caught.value)
