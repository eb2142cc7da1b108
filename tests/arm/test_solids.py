"""Solids of links: read, written, and carried with the frames that they are described in."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import read_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.errors import FileFormatError, KindError
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from oracles.arms import random_arm, random_pose

ARM = """
base_solids = [{kind = "cylinder", diameter_mm = 150, length_mm = 80, xyz_mm = [0, 0, 40]}]
[[joint]]
kind = "revolute"
d_mm = 100
a_mm = 400
alpha_deg = 90
[joint.link]
solids = [
    {kind = "capsule", diameter_mm = 80, length_mm = 400, xyz_mm = [-200, 0, 0], rpy_deg = [0, 90, 0]},
    {kind = "box", size_mm = [20, 30, 40]},
    {kind = "sphere", diameter_m = 0.1},
]
"""


def arm_of(text: str, folder: Path) -> Arm:
    (folder / "arm.toml").write_text(text, encoding="utf-8")
    return read_arm(folder / "arm.toml")


def numbers_of(shape: Shape) -> list[float]:
    """The numbers of a shape."""
    return [float(x) for value in attrs.asdict(shape).values() for x in np.ravel(value)]


def assert_same(a: Solid, b: Solid) -> None:
    assert type(a.shape) is type(b.shape)
    assert numbers_of(a.shape) == numbers_of(b.shape)
    np.testing.assert_array_equal(a.pose, b.pose)
    assert a.guessed is b.guessed


def test_solids_of_an_arm_file(tmp_path: Path) -> None:
    """Every kind has its lengths and its pose, in metres."""
    arm = arm_of(ARM, tmp_path)
    (base,), (capsule, box, sphere) = arm.base_solids, arm.links[0].solids

    assert base.shape == Cylinder(radius=0.075, length=0.08)
    np.testing.assert_array_equal(base.pose[:3, 3], (0, 0, 0.04))
    assert capsule.shape == Capsule(radius=0.04, length=0.4)
    np.testing.assert_allclose(capsule.pose[:3, 2], (1, 0, 0), atol=1e-15)
    assert isinstance(box.shape, Box)
    np.testing.assert_array_equal(box.shape.size, (0.02, 0.03, 0.04))
    assert sphere.shape == Sphere(radius=0.05)


def test_written_and_read(tmp_path: Path, rng: np.random.Generator) -> None:
    """Solids of an arm are written so that they come back to the last bit."""
    shapes = [
        Box(size=rng.uniform(0.1, 1, 3)),
        Capsule(radius=rng.uniform(), length=rng.uniform()),
        Cylinder(radius=rng.uniform(), length=rng.uniform()),
        Sphere(radius=rng.uniform()),
    ]
    solids = [Solid(shape=shape, pose=random_pose(rng), guessed=rng.random() < 0.5) for shape in shapes]
    arm = random_arm(rng, 3)
    links = [attrs.evolve(link, solids=solids[i:]) for i, link in enumerate(arm.links)]
    arm = attrs.evolve(arm, links=links, base_solids=solids[:1])

    back = arm_of(toml_text(arm), tmp_path)

    for a, b in zip(
        [arm.base_solids, *(x.solids for x in arm.links)],
        [back.base_solids, *(x.solids for x in back.links)],
        strict=True,
    ):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            assert_same(one, other)


def test_modified_rows_carry_their_solids(tmp_path: Path) -> None:
    """A solid of a link in a modified table is where it was described: in the frame on the joint."""
    text = """
convention = "modified"
[[joint]]
kind = "revolute"
d_mm = 200
[[joint]]
kind = "revolute"
a_mm = 300
alpha_deg = 30
[joint.link]
solids = [{kind = "sphere", diameter_mm = 10, xyz_mm = [50, 0, 0]}]
[[joint]]
kind = "revolute"
a_mm = 100
alpha_deg = -90
"""
    arm = arm_of(text, tmp_path)
    (solid,) = arm.links[1].solids

    X = link_poses(arm, np.zeros(3))[2] @ solid.pose

    # Frame 2 of the modified table is 300 mm along x of frame 1, which is 200 mm up.
    np.testing.assert_allclose(X[:3, 3], (0.35, 0, 0.2), atol=1e-15)


def test_equal_arms_may_have_other_solids(rng: np.random.Generator) -> None:
    """What a link looks like makes no other arm of it for its equations."""
    arm = random_arm(rng, 2)
    other = attrs.evolve(arm, base_solids=[Solid(shape=Sphere(radius=0.1))])

    assert arm == other
    assert hash(arm) == hash(other)
    with pytest.raises(KindError, match="solids: expected a list of Solid"):
        Link(solids=5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("solid", "message"),
    [
        (
            '{kind = "ball"}',
            "solids 1, kind: expected one of box, capsule, cylinder, mesh, sphere, got the text 'ball'",
        ),
        ('{kind = "box"}', "solids 1: missing, expected size_mm or size_m"),
        ('{kind = "box", size_mm = [1, 0, 1]}', "solids 1: size: expected three lengths above 0"),
        ('{kind = "sphere", diameter_mm = -1}', "diameter_mm: expected a number above 0, got -1"),
        ('{kind = "capsule", diameter_mm = 1}', "solids 1: missing, expected length_mm or length_m"),
        ('{kind = "sphere", diameter_mm = 3e7}', "radius: expected no more than 1000 m, got 15000"),
        ('{kind = "sphere", diameter_mm = 3, length_mm = 4}', "length_mm: unknown key"),
        ('{kind = "sphere", diameter_mm = 3, guess = 1}', "solids 1, guess: expected true or false, got 1"),
    ],
)
def test_mistakes(solid: str, message: str, tmp_path: Path) -> None:
    """A solid that is none is told by the key and the entry."""
    with pytest.raises(FileFormatError, match=message.replace("(", r"\(")):
        arm_of(f'[[joint]]\nkind = "revolute"\n[joint.link]\nsolids = [{solid}]\n', tmp_path)


def test_meshes_are_not_written() -> None:
    """An arm file has no room for triangles."""
    corners: Array = np.eye(4, 3)
    mesh = Mesh(vertices=corners, faces=[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]], name="link.stl")
    arm = Arm(name="one", joints=[Joint(kind="revolute")], links=[Link(solids=[Solid(shape=mesh)])])

    with pytest.raises(ValueError, match=r"cannot hold the triangles of the mesh 'link\.stl'"):
        toml_text(arm)
