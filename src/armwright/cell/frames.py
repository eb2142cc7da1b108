"""The frame tree: where everything is, and what hangs on what. A tree never changes; a change gives a new one."""

from collections import Counter
from collections.abc import Iterator, Mapping

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.spatial.poses import inverse_pose

WORLD = "WORLD"


def _relation(value: ArrayLike) -> Array:
    if isinstance(value, np.ndarray) and value.shape == (4, 4) and not value.flags.writeable:
        # Nobody can change it: it was checked before, or worked out here.
        return value
    return of_shape(value, (4, 4), "relation")


def _kept(X: Array) -> Array:
    """Return a pose that was worked out here, and that nobody shall change."""
    X.setflags(write=False)
    return X


@attrs.frozen(kw_only=True, eq=False)
class Node:
    """One frame.

    Attributes:
        parent: the frame it hangs on.
        relation: (4, 4) its pose seen from the parent; None while the frame has no value.
        rigid: whether the parent comes along when the frame is given another pose.
    """

    parent: str
    relation: Array | None = attrs.field(converter=attrs.converters.optional(_relation))
    rigid: bool = False


@attrs.frozen(eq=False)
class FrameTree:
    """Frames by name, each with one parent, the root of all WORLD.

    Attributes:
        nodes: every frame but WORLD.
    """

    nodes: Mapping[str, Node] = attrs.field(factory=dict)
    # Poses in the world that have been worked out, and how many frames hang on each: what a tree knows of itself. A
    # changed tree takes over what still holds, so that a chain costs its length and not the square of it.
    _worlds: dict[str, Array] = attrs.field(factory=dict, repr=False)
    _children: Mapping[str, int] = attrs.field(repr=False)

    @_children.default
    def _counted(self) -> Mapping[str, int]:
        return Counter(node.parent for node in self.nodes.values())

    def __contains__(self, name: str) -> bool:
        """Whether a frame of that name is known."""
        return name == WORLD or name in self.nodes

    def __iter__(self) -> Iterator[str]:
        """Walk through the names, parents before children."""
        yield WORLD
        depths = {WORLD: 0}
        for name in self.nodes:
            way = []
            while name not in depths:
                way.append(name)
                name = self.nodes[name].parent  # noqa: PLW2901 - the way up
            depth = depths[name]
            depths |= {below: depth + number for number, below in enumerate(reversed(way), 1)}
        yield from sorted(self.nodes, key=depths.__getitem__)

    def has_value(self, name: str) -> bool:
        """Whether the frame stands somewhere."""
        while name != WORLD and name not in self._worlds:
            node = self._node(name)
            if node.relation is None:
                return False
            name = node.parent
        return True

    def parent(self, name: str) -> str | None:
        """Return what the frame hangs on; None for WORLD.

        Raises:
            UnknownNameError: no such frame.
        """
        if name == WORLD:
            return None
        return self._node(name).parent

    def ancestors(self, name: str) -> list[str]:
        """Return the frames from the parent of ``name`` up to WORLD."""
        chain = []
        above = self.parent(name)
        while above is not None:
            chain.append(above)
            above = self.parent(above)
        return chain

    def world(self, name: str) -> Array:
        """Return the pose of a frame in the world, (4, 4).

        Raises:
            UnknownNameError: no such frame.
            InvalidValueError: the frame, or one it hangs on, has no value yet.
        """
        way = []
        while name != WORLD and (X_WF := self._worlds.get(name)) is None:
            node = self._node(name)
            if node.relation is None:
                raise InvalidValueError(f"frame {name} has no value yet")
            way.append((name, node.relation))
            name = node.parent
        X = None if name == WORLD else X_WF
        for below, relation in reversed(way):
            self._worlds[below] = X = relation if X is None else _kept(X @ relation)
        return np.eye(4) if X is None else X

    def relation(self, child: str, ancestor: str) -> Array:
        """Return the pose (4, 4) of ``child`` seen from ``ancestor``, one of the frames it hangs on.

        Raises:
            UnknownNameError: no such frame.
            InvalidValueError: the frame, or one it hangs on, has no value yet.
        """
        X, name = None, child
        while name != ancestor:
            node = self._node(name)
            if node.relation is None:
                raise InvalidValueError(f"frame {name} has no value yet")
            X = node.relation if X is None else node.relation @ X
            name = node.parent
        return np.eye(4) if X is None else X

    def declare(self, name: str) -> "FrameTree":
        """Return the tree with a frame that hangs on WORLD and has no value yet; a known frame stays as it is."""
        return self if name in self else self._with(name, Node(parent=WORLD, relation=None))

    def place(self, name: str, X_WF: ArrayLike) -> "FrameTree":
        """Return the tree with a frame set to a pose in the world; it goes on hanging on what it hung on.

        A frame that hangs rigidly takes its parent along, and that its own, up to ``leader``.
        """
        X = of_shape(X_WF, (4, 4), "pose")
        while (node := self.nodes.get(name)) is not None and node.rigid and node.relation is not None:
            X, name = X @ inverse_pose(node.relation), node.parent
        if name == WORLD:
            raise InvalidValueError("the frame WORLD is the root and cannot be assigned a pose")
        parent = WORLD if node is None else node.parent
        relation = X if parent == WORLD else _kept(inverse_pose(self.world(parent)) @ X)
        return self._with(name, Node(parent=parent, relation=relation))

    def leader(self, name: str) -> str:
        """Return the frame that gets another pose when ``name`` does: itself, or the end of its rigid links."""
        while (node := self.nodes.get(name)) is not None and node.rigid:
            name = node.parent
        return name

    def without(self, name: str) -> "FrameTree":
        """Return the tree without a frame; what hung on it keeps its pose and hangs on WORLD."""
        nodes = dict(self.nodes)
        for child, node in self.nodes.items():
            if node.parent == name:
                relation = None if not self.has_value(child) else self.world(child)
                nodes[child] = Node(parent=WORLD, relation=relation)
        nodes.pop(name, None)
        return FrameTree(nodes)

    def would_ring(self, child: str, parent: str) -> bool:
        """Whether a frame cannot hang on another because that one hangs on it, or is the same."""
        # What nothing hangs on can hang anywhere: no long path up for the common case.
        return child == parent or (self._children.get(child, 0) > 0 and child in self.ancestors(parent))

    def affix(self, child: str, parent: str, relation: ArrayLike | None = None, *, rigid: bool = False) -> "FrameTree":
        """Return the tree with ``child`` hanging on ``parent``.

        Args:
            child: the frame that follows.
            parent: the frame it follows.
            relation: (4, 4) pose of the child seen from the parent; where both stand now when left out.
            rigid: whether the parent comes along when the child is given another pose.

        Raises:
            UnknownNameError: no such frame.
            InvalidValueError: a ring would close, or a pose that is needed has no value.
        """
        if self.would_ring(child, parent):
            raise InvalidValueError(f"{child} cannot be attached to {parent}, which is attached to {child}")
        if relation is None:
            relation = _kept(inverse_pose(self.world(parent)) @ self.world(child))
        else:
            self.world(parent)
        return self._with(child, Node(parent=parent, relation=relation, rigid=rigid))

    def unfix(self, child: str) -> "FrameTree":
        """Return the tree with ``child`` cut loose: it keeps its pose and hangs on WORLD."""
        return self._with(child, Node(parent=WORLD, relation=self.world(child)))

    def _node(self, name: str) -> Node:
        try:
            return self.nodes[name]
        except KeyError:
            raise UnknownNameError("frame", name, [WORLD, *self.nodes]) from None

    def _with(self, name: str, node: Node) -> "FrameTree":
        # Only what hangs on a changed frame stands elsewhere.
        worlds = {} if self._children.get(name, 0) else {**self._worlds}
        worlds.pop(name, None)
        children = {**self._children}
        if (old := self.nodes.get(name)) is not None:
            children[old.parent] -= 1
        children[node.parent] = children.get(node.parent, 0) + 1
        return FrameTree({**self.nodes, name: node}, worlds, children)
