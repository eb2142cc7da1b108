"""Arms of the catalogue beside the joint frames of public files, and the documents that their numbers are from.

``public_frames.json`` has the joints of each public file as they are typed there: kind, position [m], roll, pitch and
yaw [rad], and axis, from the base frame of the arm on; and its tip. Each has its place, its revision and its licence.
"""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.documents import QUANTITIES, gives_geometry
from armwright.arm.load import arm_summaries, load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from oracles.catalogue import FEW, NAMES
from samples import Sample

FRAMES: dict[str, list[dict[str, Any]]] = json.loads(
    (Path(__file__).parent / "public_frames.json").read_text(encoding="utf-8")
)
# A quarter turn typed with four digits, 1.571, is this far off, nearly [rad].
SHORT = 3e-4


def transform(xyz: list[float], rotation: Rotation) -> Array:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = rotation.as_matrix(), xyz
    return X


def tip_pose(source: dict[str, Any], q: Array) -> Array:
    """The pose of the tip as a product of the transforms of the file."""
    X = np.eye(4)
    for (kind, xyz, rpy, axis), position in zip(source["joints"], q, strict=True):
        along = np.array(axis) / np.linalg.norm(axis)
        moved = (
            transform([0, 0, 0], Rotation.from_rotvec(position * along))
            if kind == "revolute"
            else transform((position * along).tolist(), Rotation.identity())
        )
        X = X @ transform(xyz, Rotation.from_euler("xyz", rpy)) @ moved
    xyz, rpy = source["tip"]
    return X @ transform(xyz, Rotation.from_euler("xyz", rpy))


def typed_short(source: dict[str, Any]) -> float:
    """How far the quarter turns of a file are off altogether, because they are typed with few digits [rad]."""
    angles = np.array([angle for joint in source["joints"] for angle in joint[2]] + source["tip"][1])
    off = np.abs(np.remainder(angles + math.pi / 4, math.pi / 2) - math.pi / 4)
    return float(off[off < SHORT].sum())


@pytest.mark.drawn(0.2)
@pytest.mark.parametrize("name", FRAMES)
def test_poses_of_public_files(name: str, sample: Sample) -> None:
    """In a hundred configurations the tool is where each public file has it, but for what its digits leave open."""
    arm, rng = load_arm(name), np.random.default_rng(sample.seed)
    q = rng.uniform(np.maximum(arm.limits.lower, -math.pi), np.minimum(arm.limits.upper, math.pi), (100, arm.n))
    ours, length = forward(arm, q), sum(joint.span() for joint in arm.joints) + np.linalg.norm(arm.tool[:3, 3])
    for source in FRAMES[name]:
        theirs = np.array([tip_pose(source, one) for one in q])
        off = typed_short(source) + source.get("digits", 0.0)
        np.testing.assert_allclose(ours[:, :3, :3], theirs[:, :3, :3], rtol=0, atol=1e-9 + off)
        np.testing.assert_allclose(ours[:, :3, 3], theirs[:, :3, 3], rtol=0, atol=1e-9 + off * (1 + length))


def test_places_of_public_files() -> None:
    """The files compared with are those that the arms name: one that gives the geometry, and those that confirm it."""
    for summary in arm_summaries():
        if summary.name in FRAMES:
            named = {(d.repository, d.path, d.revision) for d in summary.documents if gives_geometry(d)}
            assert named == {(d["repository"], d["path"], d["revision"]) for d in FRAMES[summary.name]}, summary.name
        else:
            assert not any(document.path for document in summary.documents), summary.name


def quantities_of(arm: Arm) -> set[str]:
    """Which kinds of numbers an arm has."""
    limits = {"speeds": arm.limits.speed, "accelerations": arm.limits.acceleration, "efforts": arm.limits.effort}
    found = {"geometry"} | {name for name, values in limits.items() if np.isfinite(values).any()}
    found |= {"positions"} if np.isfinite([arm.limits.lower, arm.limits.upper]).any() else set()
    found |= {"masses"} if any(link.mass for link in arm.links) else set()
    found |= {"inertias"} if any(link.inertia.any() for link in arm.links) else set()
    found |= {"solids"} if arm.base_solids or any(link.solids for link in arm.links) else set()
    found |= {"coupling"} if arm.coupling is not None else set()
    found |= {"drives"} if arm.motor_values("inertia").any() else set()
    return found | ({"hand"} if math.isfinite(arm.reach) else set())


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_every_number_has_one_document(name: str) -> None:
    """Of each kind of numbers that an arm has, one document says that it gives it, and none of what it has not."""
    arm = load_arm(name)
    given = [quantity for document in arm.documents for quantity in document.gives]

    assert sorted(given) == sorted(quantities_of(arm))
    assert set(given) <= set(QUANTITIES)


def test_the_page_lists_every_arm() -> None:
    """The page of arm files has a row for each arm, as docs/make_arms.py writes it from their documents."""
    page = (Path(__file__).parents[2] / "docs" / "arms.md").read_text(encoding="utf-8")
    heads = "positions", "speeds", "efforts", "masses", "drives", "coupling", "solids"
    for arm in arm_summaries():
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{arm.name}` |")]
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        given = {quantity for document in arm.documents for quantity in document.gives}
        two = sum(map(gives_geometry, arm.documents)) > 1

        assert cells[1:4] == [arm.title, str(arm.joints), "two documents" if two else "one document"]
        assert [cell == "yes" for cell in cells[4:]] == [head in given for head in heads]


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_the_list_says_what_the_arm_is(name: str) -> None:
    """The list, which reads the beginnings of the files only, says what the arm says that is read whole."""
    (summary,) = [each for each in arm_summaries() if each.name == name]
    arm = load_arm(name)

    assert (summary.name, summary.joints) == (arm.name, arm.n)
    assert (summary.title, summary.source, summary.documents) == (arm.title, arm.source, arm.documents)
