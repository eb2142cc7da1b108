"""Pairs of bodies that an arm file adds to those that are checked for collisions, or takes away."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.collision_pairs import CollisionPairs
from armwright.arm.load import read_arm
from armwright.arm.model import Arm
from armwright.arm.write import toml_text
from armwright.errors import ArmwrightError, FileFormatError
from oracles.arms import random_arm

JOINT = '[[joint]]\nkind = "revolute"\n'
NAMED = f'{JOINT}{JOINT}[joint.link]\nname = "elbow"\n{JOINT}'


def arm_of(text: str, folder: Path) -> Arm:
    (folder / "arm.toml").write_text(text, encoding="utf-8")
    return read_arm(folder / "arm.toml")


def test_names_of_bodies(tmp_path: Path) -> None:
    """A body is named by its number or by its link, in any order; the base and the tool have names too."""
    pairs = '[collisions]\nleave_out = [["elbow", "base"], ["link 1", "tool"]]\ncheck = [["link 3", "link 2"]]\n'

    arm = arm_of(pairs + NAMED, tmp_path)

    assert arm.collisions == CollisionPairs(leave_out=[(0, 2), (1, 4)], check=[(2, 3)])
    assert arm_of(NAMED, tmp_path).collisions == CollisionPairs()


def test_written_and_read(tmp_path: Path, rng: np.random.Generator) -> None:
    """Pairs come back from a file as they were, also where a link has the name of another body."""
    arm = random_arm(rng, 4)
    links = [
        attrs.evolve(link, name=name) for link, name in zip(arm.links, ("link 3", "", "base", "elbow"), strict=True)
    ]
    bodies = [(a, b) for a in range(6) for b in range(a)]
    chosen = rng.permutation(len(bodies))[:8]
    lists = [[bodies[i] for i in chosen[:k]] for k in (5, 0)] + [[bodies[i] for i in chosen[5:]]]
    for leave_out, check in (lists[:2], lists[1:], (lists[0], lists[2])):
        pairs = CollisionPairs(leave_out=leave_out, check=check)

        back = arm_of(toml_text(attrs.evolve(arm, links=links, collisions=pairs)), tmp_path)

        assert back.collisions == pairs


def test_equal_arms_may_have_other_pairs(rng: np.random.Generator) -> None:
    """Which bodies are checked makes no other arm of it for its equations."""
    arm = random_arm(rng, 3)
    other = attrs.evolve(arm, collisions=CollisionPairs(check=[(0, 1)]))

    assert arm == other
    assert hash(arm) == hash(other)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ('leave_out = [["link 1", "elbwo"]]', r"collisions, leave_out 1: no body 'elbwo'\. Did you mean 'elbow'\?"),
        ('check = [["base", "link 2"], ["lnk 2", "base"]]', r"check 2: no body 'lnk 2'\. Did you mean 'link 2'\?"),
        ('check = [["link 4", "base"]]', r"check 1: no body 'link 4'\."),
        ('check = [["elbow", "link 2"]]', "check 1: expected two bodies, got 'elbow' and 'link 2'"),
        ('check = [["elbow"]]', "check 1: expected 2 texts in quotes, got a list of 1"),
        ("check = [[1, 2]]", "check 1: expected 2 texts in quotes, got a list of 2"),
        ('check = "elbow"', "check: expected a list of lists of 2 texts in quotes, got the text 'elbow'"),
        (
            'leave_out = [["base", "elbow"]]\ncheck = [["link 2", "base"]]',
            "check 1: the pair of 'link 2' and 'base' is also in leave_out",
        ),
        ("leaveout = []", r"leaveout: unknown key; did you mean 'leave_out'\?"),
    ],
)
def test_mistakes(pairs: str, message: str, tmp_path: Path) -> None:
    """A pair that is none is told by its list, its number and the nearest name."""
    with pytest.raises(FileFormatError, match=rf"arm\.toml:\d+: .*{message}"):
        arm_of(f"[collisions]\n{pairs}\n{NAMED}", tmp_path)


def test_more_pairs_than_are_read(tmp_path: Path) -> None:
    """A list of more pairs than the limit of entries is refused."""
    row = '["base", "tool"],'

    with pytest.raises(FileFormatError, match=r"leave_out: too many: .*10,?001"):
        arm_of(f"[collisions]\nleave_out = [{row * 10_001}]\n{NAMED}", tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"check": [(0, 0)]}, r"expected two bodies, numbered from 0, got \(0, 0\)"),
        ({"check": [(-1, 2)]}, "numbered from 0"),
        ({"check": [(1, 2, 3)]}, "expected a pair of numbers of bodies"),
        ({"check": 5}, "expected pairs of numbers of bodies, got 5"),
        ({"check": [("base", "tool")]}, r"expected a pair of numbers of bodies, got \('base', 'tool'\)"),
        (
            {"check": [(1, 2)], "leave_out": [(2, 1)]},
            r"the pair of bodies \(1, 2\) is both to be checked and to be left out",
        ),
    ],
)
def test_mistakes_in_python(arguments: dict[str, object], message: str) -> None:
    """Pairs that a caller hands in are checked as those of files are."""
    with pytest.raises(ArmwrightError, match=message):
        CollisionPairs(**arguments)  # type: ignore[arg-type]


def test_bodies_that_an_arm_has_not(rng: np.random.Generator) -> None:
    """Bodies are numbered up to what the tool holds."""
    arm = random_arm(rng, 3)

    assert attrs.evolve(arm, collisions=CollisionPairs(check=[(0, 4)])).collisions.check == ((0, 4),)
    with pytest.raises(ValueError, match=r"expected numbers of bodies from 0 \(the base\) to 4 \(the tool\), got 5"):
        attrs.evolve(arm, collisions=CollisionPairs(check=[(0, 5)]))
    with pytest.raises(TypeError, match="collisions: expected CollisionPairs, got 7"):
        attrs.evolve(arm, collisions=7)
