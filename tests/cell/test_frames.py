"""The frame tree."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from armwright.arrays import Array
from armwright.cell.frames import WORLD, FrameTree, Node
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.spatial.poses import homogeneous
from oracles.arms import random_pose
from samples import Sample, examples

ROUNDING = 1e-9  # products of a dozen poses some metres long


def step(x: float, y: float = 0.0, z: float = 0.0) -> Array:
    return homogeneous(np.eye(3), (x, y, z))


@pytest.fixture
def bench() -> FrameTree:
    """A bench one metre away with a cup on it, and a lid on the cup."""
    tree = FrameTree().set_pose("BENCH", step(1)).set_pose("CUP", step(1, 0, 0.8)).affix("CUP", "BENCH")
    return tree.declare("LID").affix("LID", "CUP", step(0, 0, 0.1))


def test_what_hangs_follows(bench: FrameTree) -> None:
    """Moving the bench moves the cup and the lid."""
    moved = bench.set_pose("BENCH", step(2))

    np.testing.assert_allclose(moved.world("LID"), step(2, 0, 0.9), atol=ROUNDING)


def test_unfix_leaves_things_where_they_are(bench: FrameTree) -> None:
    """A cup that is cut loose stays in its place and no longer follows the bench."""
    loose = bench.unfix("CUP").set_pose("BENCH", step(5))

    np.testing.assert_allclose(loose.world("CUP"), step(1, 0, 0.8), atol=ROUNDING)
    assert loose.parent("CUP") == WORLD


def test_placing_keeps_hanging(bench: FrameTree) -> None:
    """A cup set to a new place on the bench goes on following the bench from there."""
    moved = bench.set_pose("CUP", step(1, 0.3, 0.8)).set_pose("BENCH", step(2))

    np.testing.assert_allclose(moved.world("CUP"), step(2, 0.3, 0.8), atol=ROUNDING)


def test_no_ring(bench: FrameTree) -> None:
    """The bench cannot be attached to the lid of the cup that stands on it, nor anything on itself."""
    with pytest.raises(InvalidValueError, match="BENCH cannot be attached to LID"):
        bench.affix("BENCH", "LID")
    with pytest.raises(InvalidValueError, match="CUP cannot be attached to CUP"):
        bench.affix("CUP", "CUP")


def test_frames_without_a_value() -> None:
    """A declared frame has no place until it gets one, and neither has what hangs on it."""
    tree = FrameTree().declare("A")

    assert not tree.has_value("A")
    with pytest.raises(InvalidValueError, match="frame A has no value yet"):
        tree.world("A")
    with pytest.raises(InvalidValueError, match="no value yet"):
        tree.declare("B").affix("B", "A", step(1))


def test_unknown_frame(bench: FrameTree) -> None:
    """A misspelt frame gets the nearest name."""
    with pytest.raises(UnknownNameError, match="Did you mean 'BENCH'"):
        bench.world("BENSH")


def test_a_long_chain() -> None:
    """Five thousand frames, each hanging on the one before, are as deep as they are and no deeper than Python."""
    tree = FrameTree().set_pose("F0", step(0))
    nodes = dict(tree.nodes)
    for i in range(1, 5000):
        nodes[f"F{i}"] = Node(parent=f"F{i - 1}", relation=step(1e-3))
    tree = FrameTree(nodes)

    np.testing.assert_allclose(tree.world("F4999"), step(4.999), atol=ROUNDING)
    assert tree.has_value("F4999")


def test_a_long_rigid_chain() -> None:
    """The end of a chain that hangs rigidly takes all of it along, however long it is."""
    links = {f"F{i}": Node(parent=f"F{i - 1}", relation=step(1), rigid=True) for i in range(1, 3000)}

    tree = FrameTree({"F0": Node(parent=WORLD, relation=step(1)), **links}).set_pose("F2999", step(0))

    assert tree.rigid_root("F2999") == "F0"
    np.testing.assert_allclose(tree.world("F0"), step(-2999), atol=ROUNDING)
    np.testing.assert_allclose(tree.world("F2999"), step(0), atol=ROUNDING)


def test_world_is_fixed() -> None:
    """The root of the tree cannot be placed."""
    with pytest.raises(InvalidValueError, match="WORLD is the root"):
        FrameTree().set_pose("WORLD", step(1))


names = st.sampled_from("ABCDEF")
changes = st.lists(
    st.tuples(st.sampled_from(["set_pose", "affix", "at", "unfix"]), names, names, st.integers(0, 99)), max_size=25
)


@settings(max_examples=examples(200))
@given(changes)
def test_any_history(history: list[tuple[str, str, str, int]]) -> None:
    """Whatever is done to a tree: there is no ring, unfix keeps places, affix keeps places, parents carry children."""
    tree = FrameTree()
    for name in "ABCDEF":
        tree = tree.set_pose(name, random_pose(np.random.default_rng(ord(name))))
    for kind, name, other, seed in history:
        X = random_pose(np.random.default_rng(seed))
        before = {frame: tree.world(frame) for frame in tree}
        below = {frame for frame in tree if name in tree.ancestors(frame)}
        if kind == "set_pose":
            tree = tree.set_pose(name, X)
            np.testing.assert_allclose(tree.world(name), X, atol=ROUNDING)
            for frame in set(before) - below - {name}:
                np.testing.assert_allclose(tree.world(frame), before[frame], atol=ROUNDING)
            continue
        if kind == "unfix":
            tree = tree.unfix(name)
        elif name == other or other in below:
            with pytest.raises(InvalidValueError, match="cannot be attached to"):
                tree.affix(name, other)
        elif kind == "affix":
            tree = tree.affix(name, other)
        else:
            tree = tree.affix(name, other, X)
            np.testing.assert_allclose(tree.world(name), tree.world(other) @ X, atol=ROUNDING)
            continue
        for frame, place in before.items():
            np.testing.assert_allclose(tree.world(frame), place, atol=ROUNDING)
    for frame in tree:
        chain = [frame, *tree.ancestors(frame)]
        assert len(chain) == len(set(chain))
        assert chain[-1] == WORLD
        np.testing.assert_allclose(tree.relation(frame, WORLD), tree.world(frame), atol=ROUNDING)


NAMES = tuple(f"F{number}" for number in range(8))


def changed(tree: FrameTree, rng: np.random.Generator) -> FrameTree:
    """Return a tree with one change drawn at random, or the same where what was drawn cannot be done."""
    one, other = (str(name) for name in rng.choice(NAMES, 2, replace=False))
    both = one in tree and other in tree and not tree.would_close_cycle(one, other)
    changes = {
        "set_pose": lambda: tree.set_pose(one, random_pose(rng)),
        "affix": lambda: tree.affix(one, other) if both else tree,
        "affix at": lambda: tree.affix(one, other, random_pose(rng), rigid=bool(rng.integers(2))) if both else tree,
        "unfix": lambda: tree.unfix(one) if one in tree else tree,
        "without": lambda: tree.without(one) if one in tree else tree,
    }
    return changes[str(rng.choice([*changes]))]()


def test_worlds_that_were_asked_for_before(sample: Sample) -> None:
    """Where a frame stands depends on the tree alone, to the last bit, and not on what was asked of it before."""
    for rng in sample.cases(200):
        tree = FrameTree()
        for _ in range(60):
            tree = changed(tree, rng)
            for name in rng.permutation([*tree])[:3]:
                tree.world(str(name))
        anew, order = FrameTree(dict(tree.nodes)), [*tree]
        for name in tree:
            np.testing.assert_array_equal(tree.world(name), anew.world(name))
            np.testing.assert_allclose(tree.world(name), tree.relation(name, WORLD), atol=ROUNDING)
            assert name == WORLD or order.index(tree.nodes[name].parent) < order.index(name)
            for child in tree.nodes:
                assert tree.would_close_cycle(child, name) == (child == name or child in tree.ancestors(name))
    sample.record("frame trees after 60 changes: poses as of a tree made anew, to the bit", sample.count(200), 0)


def test_a_chain_is_not_gone_through_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A frame at the end of a chain that hangs another one on itself is found without the chain below it."""
    looked: list[str] = []
    node = FrameTree._node
    monkeypatch.setattr(FrameTree, "_node", lambda tree, name: looked.append(name) or node(tree, name))
    tree = FrameTree().set_pose("F0", step(1))
    for number in range(1, 500):
        tree = tree.declare(f"F{number}").set_pose(f"F{number}", step(number)).affix(f"F{number}", f"F{number - 1}")

    np.testing.assert_allclose(tree.world("F499"), step(499), atol=ROUNDING)
    assert len(looked) < 3000
