"""What links of URDF files look like: read as Pinocchio reads it, and written so that Pinocchio finds it there."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import coal
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Link
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
from armwright.arrays import Array
from armwright.errors import FileFormatError
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from oracles.arms import random_arm, random_pose
from oracles.catalogue import FEW, NAMES
from oracles.solids import coal_shape, random_shape
from oracles.urdf import KINDS, RELATIONS, random_urdf, written
from urdf_texts import LIMIT, MASS, joint, link, one, robot

AGREEMENT = 1e-9

Placed = list[tuple[tuple[float, ...], Array]]


def numbers_of(shape: Any) -> tuple[float, ...]:
    """The lengths of a shape of coal, which tell its kind too."""
    if isinstance(shape, coal.Box):
        return tuple(2 * shape.halfSide)
    return (shape.radius, 2 * shape.halfLength) if isinstance(shape, coal.Cylinder) else (shape.radius,)


def known(text: str, q: Array) -> Placed:
    """The shapes of a file that collide, and where they are in a configuration, by Pinocchio."""
    model = pin.buildModelFromXML(text)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    data, placed = model.createData(), pin.GeometryData(shapes)
    # Pinocchio counts a continuous joint as a cosine and a sine, and has the joints in an order of its own.
    full, order = (
        pin.neutral(model),
        re.findall(r'<joint name="([^"]*)" type="(?:revolute|continuous|prismatic)"', text),
    )
    for name, position in zip(order, q, strict=True):
        moving = model.joints[model.getJointId(name)]
        full[moving.idx_q : moving.idx_q + moving.nq] = (
            [position] if moving.nq == 1 else [np.cos(position), np.sin(position)]
        )
    pin.updateGeometryPlacements(model, data, shapes, placed, full)
    return [
        (numbers_of(shapes.geometryObjects[i].geometry), np.asarray(placed.oMg[i].homogeneous))
        for i in range(shapes.ngeoms)
    ]


def ours(arm: Arm, q: Array) -> Placed:
    """The solids of an arm, none of which is a capsule, and where they are in its base frame."""
    return [(numbers_of(coal_shape(shape)), X) for shape, X in placed(arm, q)]


def assert_same(a: Placed, b: Placed) -> None:
    """The same shapes at the same poses, in any order."""
    left = list(b)
    for numbers, X in a:
        same = [i for i, (others, Y) in enumerate(left) if near(numbers, others) and near(X, Y)]
        assert same, (numbers, X, left)
        left.pop(same[0])
    assert not left


def near(a: Any, b: Any) -> bool:
    return len(a) == len(b) and np.allclose(a, b, rtol=0, atol=AGREEMENT)


def element(tag: str, shape: Shape, xyz: Array, rpy: Array) -> str:
    match shape:
        case Box(size=size):
            form = f'<box size="{written(size)}"/>'
        case Cylinder(radius=radius, length=length):
            form = f'<cylinder radius="{radius!r}" length="{length!r}"/>'
        case Sphere(radius=radius):
            form = f'<sphere radius="{radius!r}"/>'
        case _:
            raise NotImplementedError
    origin = f'<origin xyz="{written(xyz)}" rpy="{written(rpy)}"/>'
    return f"<{tag}>{origin}<geometry>{form}</geometry></{tag}>"


def primitive(rng: np.random.Generator) -> Shape:
    shape = random_shape(rng)
    return primitive(rng) if isinstance(shape, Capsule) else shape


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Arm]:
    """Read an arm from a text."""

    def reading(text: str, **ends: str) -> Arm:
        (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
        return load_urdf(tmp_path / "arm.urdf", **ends)

    return reading


@pytest.mark.drawn(0.4)
@pytest.mark.parametrize("joints", range(1, 8))
def test_random_chains(joints: int, rng: np.random.Generator, read: Callable[..., Arm]) -> None:
    """Boxes, cylinders and spheres of links of every kind of chain, welded ones too, are where Pinocchio has them."""
    for _ in range(10):

        def dressed(found: re.Match[str], rng: np.random.Generator = rng) -> str:
            shapes = [primitive(rng) for _ in range(rng.integers(0, 3))]
            seen = element("visual", Sphere(radius=9.0), np.zeros(3), np.zeros(3)) if shapes else ""
            return (
                found[0]
                + seen
                + "".join(element("collision", shape, rng.normal(size=3), rng.uniform(-3, 3, 3)) for shape in shapes)
            )

        plan = [(str(rng.choice(KINDS)), str(rng.choice(RELATIONS))) for _ in range(joints)]
        text = re.sub('<link name="[^"]*">', dressed, random_urdf(rng, plan))
        q = rng.uniform(-2, 2, joints)

        arm = read(text, tip="hand")

        assert_same(ours(arm, q), known(text, q))


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", [*NAMES, "random"])
def test_written(name: str, rng: np.random.Generator, read: Callable[..., Arm]) -> None:
    """Pinocchio finds the solids of an arm in the file that it is written to, and so do we; capsules in parts."""
    if name == "random":
        arm = random_arm(rng, 4)
        solids = [Solid(shape=random_shape(rng), pose=random_pose(rng)) for _ in range(6)]
        arm = attrs.evolve(
            arm, base_solids=solids[:2], links=[attrs.evolve(x, solids=solids[i:]) for i, x in enumerate(arm.links)]
        )
    else:
        arm = load_arm(name)
    q, text = rng.uniform(-1, 1, arm.n), urdf_text(arm)

    theirs = known(text, q)

    assert_same(ours(read(text), q), theirs)
    assert_same(theirs, [part for solid in placed(arm, q) for part in parts_of(*solid)])


def placed(arm: Arm, q: Array) -> list[tuple[Shape, Array]]:
    """The shapes of an arm, and where they are in its base frame."""
    frames = link_poses(arm, q)
    solids = [(np.eye(4), solid) for solid in arm.base_solids]
    solids += [(frames[i], solid) for i, each in enumerate(arm.links, 1) for solid in each.solids]
    return [(solid.shape, X @ solid.pose) for X, solid in solids]


def parts_of(shape: Shape, X: Array) -> Placed:
    """A shape in those that URDF has."""
    if not isinstance(shape, Capsule):
        return [(numbers_of(coal_shape(shape)), X)]
    parts: Placed = [((shape.radius, shape.length), X)]
    for end in (-shape.length / 2, shape.length / 2):
        Y = X.copy()
        Y[:3, 3] += end * X[:3, 2]
        parts.append(((shape.radius,), Y))
    return parts


BALL = '<geometry><sphere radius="0.1"/></geometry>'
SEEN, MET = (f"<{tag}>{BALL}</{tag}>" for tag in ("visual", "collision"))


def hand(inside: str) -> str:
    """One joint about z, and a hand with something in it."""
    return one().replace('<link name="hand"></link>', f'<link name="hand">{inside}</link>')


def test_what_is_drawn_where_nothing_collides(read: Callable[..., Arm]) -> None:
    """What is drawn of a link counts where it has no <collision>, and not where it has."""
    drawn = '<visual><origin xyz="1 2 3"/><geometry><box size="0.1 0.2 0.3"/></geometry></visual>'

    (box,) = read(hand(drawn)).links[0].solids
    (ball,) = read(hand(drawn + MET)).links[0].solids

    assert isinstance(box.shape, Box)
    np.testing.assert_array_equal(box.shape.size, (0.1, 0.2, 0.3))
    np.testing.assert_array_equal(box.pose[:3, 3], (1, 2, 3))
    assert ball.shape == Sphere(radius=0.1)
    # A <collision> without a shape says nothing.
    assert len(read(hand(SEEN + "<collision/>")).links[0].solids) == 1


def test_capsules_are_read(read: Callable[..., Arm]) -> None:
    """A capsule, which newer versions of URDF have, is one solid."""
    (solid,) = (
        read(hand('<collision><geometry><capsule radius="0.1" length="0.4"/></geometry></collision>')).links[0].solids
    )

    assert solid.shape == Capsule(radius=0.1, length=0.4)


def test_what_stands_with_the_base(read: Callable[..., Arm]) -> None:
    """Solids of the base link, and of those fixed to it, are solids of the base, and what moves beside is none."""
    text = robot(
        link("base", MASS + MET),
        link("plate", MET),
        link("other", MASS + MET),
        link("hand", MASS + MET),
        joint("turn", "revolute", "base", "hand", LIMIT),
        joint("second", "revolute", "base", "other", LIMIT),
        joint("screws", "fixed", "base", "plate", '<origin xyz="0 0 0.5"/>'),
    )

    arm = read(text, tip="hand")

    assert [solid.pose[2, 3] for solid in arm.base_solids] == [0, 0.5]
    assert [len(each.solids) for each in arm.links] == [1]


def test_a_body_of_unknown_inertia_has_solids(read: Callable[..., Arm]) -> None:
    """What a link looks like is known, though its inertia is none that a body has."""
    wrong = MASS.replace('ixx="1"', 'ixx="9"')

    arm = read(hand(wrong + MET))

    assert arm.links[0].unknown
    assert len(arm.links[0].solids) == 1


@pytest.mark.parametrize(
    "shape",
    [
        '<cylinder radius="0.1" length="0"/>',
        '<box size="1 1 0"/>',
        '<sphere radius="-1"/>',
        '<box size="1 1 5000"/>',
        "<plane/>",
    ],
)
def test_shapes_that_are_not_read(shape: str, tmp_path: Path) -> None:
    """A shape that is no solid is left out, and it is said of which link."""
    (tmp_path / "arm.urdf").write_text(hand(f"<collision><geometry>{shape}</geometry></collision>{MET}"))

    reading = read_urdf(tmp_path / "arm.urdf")

    assert len(reading.arm.links[0].solids) == 1
    assert reading.notes == (
        "of shapes, boxes, cylinders, spheres and capsules up to 1000 m are read; links with others: 'hand'",
    )


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (
            '<collision><geometry><sphere radius="big"/></geometry></collision>',
            "collision, geometry, sphere, radius: expected",
        ),
        ('<collision><geometry><box size="1 2"/></geometry></collision>', "box, size: expected 3 numbers, got 2"),
        ('<collision><geometry><cylinder radius="1"/></geometry></collision>', "cylinder, length: missing"),
        (f'<collision>{BALL}<origin xyz="x"/></collision>', "collision, origin, xyz: expected a number, got 'x'"),
        (f"<collison>{BALL}</collison>", "unknown element; did you mean <collision>?"),
        ('<visual><geometry><sphre radius="1"/></geometry></visual>', "unknown element; did you mean <sphere>?"),
        ('<visual><geometry><sphere raduis="1"/></geometry></visual>', "unknown attribute; did you mean 'radius'?"),
        (f"<visual>{BALL}{BALL}</visual>", "geometry: occurs twice"),
    ],
)
def test_mistakes(inside: str, message: str, read: Callable[..., Arm]) -> None:
    """A shape that is not written as one is told by the link and the element."""
    with pytest.raises(FileFormatError, match=re.escape(message)):
        read(hand(inside))


def test_what_is_lost() -> None:
    """It is said what of the solids a URDF file does not hold."""
    corners = np.eye(4, 3)
    mesh = Solid(shape=Mesh(vertices=corners, faces=[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    guess = Solid(shape=Sphere(radius=0.1), guessed=True)
    capsule = Solid(shape=Capsule(radius=0.1, length=0.2))
    arm = attrs.evolve(
        load_arm("ntu-3r"), base_solids=[capsule], links=[Link(solids=[guess]), Link(solids=[mesh, capsule]), Link()]
    )

    lost = lost_in_urdf(arm)

    assert [sentence for sentence in lost if "in the file" in sentence and "capsules" in sentence] == [
        "link 2: its capsules are cylinders with two spheres in the file",
        "base: its capsules are cylinders with two spheres in the file",
    ]
    assert "link 1: that its solids are guesses is not in the file" in lost
    assert "link 2: its meshes are not in the file" in lost
    assert urdf_text(arm).count("<collision>") == 7
