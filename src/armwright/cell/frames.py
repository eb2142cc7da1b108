"""The frame tree: the pose of every frame relative to its parent. A tree is immutable; a change returns a new tree."""

from collections import Counter
from collections.abc import Iterator, Mapping

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.spatial.poses import inverse_pose

WORLD = "WORLD"


def _as_relation(value: ArrayLike) -> Array:
    if isinstance(value, np.ndarray) and value.shape == (4, 4) and not value.flags.writeable:
        # It was checked before or computed here, and cannot be changed.
        return value
    return of_shape(value, (4, 4), "relation")


def _freeze(X: Array) -> Array:
    """Return a computed pose, made read-only."""
    X.setflags(write=False)
    return X


@attrs.frozen(kw_only=True, eq=False)
class Node:
    """A frame.

    Attributes:
        parent: the frame to which it is attached.
        relation: (4, 4) its pose relative to the parent; None while the frame has no value.
        rigid: whether the parent moves too when the frame is assigned another pose.
    """

    parent: str
    relation: Array | None = attrs.field(converter=attrs.converters.optional(_as_relation))
    rigid: bool = False


@attrs.frozen(eq=False)
class FrameTree:
    """Frames by name, each with one parent; the root is WORLD.

    Attributes:
        nodes: every frame but WORLD.
    """

    nodes: Mapping[str, Node] = attrs.field(factory=dict)
    # Caches: computed poses in the world, and the number of children of each frame. A changed tree takes over what is
    # still valid, so that building a chain takes time linear in its length.
    _worlds: dict[str, Array] = attrs.field(factory=dict, repr=False)
    _children: Mapping[str, int] = attrs.field(repr=False)

    @_children.default
    def _count_children(self) -> Mapping[str, int]:
        return Counter(node.parent for node in self.nodes.values())

    def __contains__(self, name: str) -> bool:
        """Whether there is a frame of that name."""
        return name == WORLD or name in self.nodes

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, parents before children."""
        yield WORLD
        depths = {WORLD: 0}
        for name in self.nodes:
            path = []
            while name not in depths:
                path.append(name)
                name = self.nodes[name].parent  # noqa: PLW2901 - up the tree
            depth = depths[name]
            depths |= {descendant: depth + number for number, descendant in enumerate(reversed(path), 1)}
        yield from sorted(self.nodes, key=depths.__getitem__)

    def has_value(self, name: str) -> bool:
        """Whether the frame and all its ancestors have values."""
        while name != WORLD and name not in self._worlds:
            node = self._node(name)
            if node.relation is None:
                return False
            name = node.parent
        return True

    def parent(self, name: str) -> str | None:
        """Return the parent of a frame; None for WORLD.

        Raises:
            UnknownNameError: there is no such frame.
        """
        return None if name == WORLD else self._node(name).parent

    def ancestors(self, name: str) -> list[str]:
        """Return the frames from the parent of ``name`` up to WORLD."""
        chain = []
        while (parent := self.parent(name)) is not None:
            chain.append(parent)
            name = parent
        return chain

    def world(self, name: str) -> Array:
        """Return the pose of a frame in the world, (4, 4).

        Raises:
            UnknownNameError: there is no such frame.
            InvalidValueError: the frame, or an ancestor, has no value yet.
        """
        path = []
        while name != WORLD and (X_WF := self._worlds.get(name)) is None:
            parent, relation = self._attachment(name)
            path.append((name, relation))
            name = parent
        X = None if name == WORLD else X_WF
        for descendant, relation in reversed(path):
            self._worlds[descendant] = X = relation if X is None else _freeze(X @ relation)
        return np.eye(4) if X is None else X

    def relation(self, child: str, ancestor: str) -> Array:
        """Return the pose (4, 4) of ``child`` relative to ``ancestor``, one of its ancestors.

        Raises:
            UnknownNameError: there is no such frame.
            InvalidValueError: the frame, or an ancestor, has no value yet.
        """
        X, name = None, child
        while name != ancestor:
            name, relation = self._attachment(name)
            X = relation if X is None else relation @ X
        return np.eye(4) if X is None else X

    def declare(self, name: str) -> "FrameTree":
        """Return the tree with a frame that is attached to WORLD and has no value; a known frame is not changed."""
        return self if name in self else self._with_node(name, Node(parent=WORLD, relation=None))

    def set_pose(self, name: str, X_WF: ArrayLike) -> "FrameTree":
        """Return the tree with a frame assigned a pose in the world; its parent remains.

        A rigidly attached frame moves its parent, and so on up to ``rigid_root``.
        """
        X = of_shape(X_WF, (4, 4), "pose")
        while (node := self.nodes.get(name)) is not None and node.rigid and node.relation is not None:
            X, name = X @ inverse_pose(node.relation), node.parent
        if name == WORLD:
            raise InvalidValueError("the frame WORLD is the root and cannot be assigned a pose")
        parent = WORLD if node is None else node.parent
        relation = X if parent == WORLD else _freeze(inverse_pose(self.world(parent)) @ X)
        return self._with_node(name, Node(parent=parent, relation=relation))

    def rigid_root(self, name: str) -> str:
        """Return the frame that moves when ``name`` is assigned a pose: itself, or the end of its rigid attachments."""
        while (node := self.nodes.get(name)) is not None and node.rigid:
            name = node.parent
        return name

    def without(self, name: str) -> "FrameTree":
        """Return the tree without a frame; its children keep their poses and are attached to WORLD."""
        nodes = dict(self.nodes)
        for child, node in self.nodes.items():
            if node.parent == name:
                nodes[child] = Node(parent=WORLD, relation=self.world(child) if self.has_value(child) else None)
        nodes.pop(name, None)
        return FrameTree(nodes)

    def would_close_cycle(self, child: str, parent: str) -> bool:
        """Whether attaching a frame to another would close a cycle: the other is the same frame, or a descendant."""
        # A frame without children closes none: the common case needs no search.
        return child == parent or (self._children.get(child, 0) > 0 and child in self.ancestors(parent))

    def affix(self, child: str, parent: str, relation: ArrayLike | None = None, *, rigid: bool = False) -> "FrameTree":
        """Return the tree with ``child`` attached to ``parent``.

        Args:
            child: the frame to attach.
            parent: its new parent.
            relation: (4, 4) pose of the child relative to the parent; the default is the current one.
            rigid: whether the parent moves too when the child is assigned another pose.

        Raises:
            UnknownNameError: there is no such frame.
            InvalidValueError: a cycle would close, or a required pose has no value.
        """
        if self.would_close_cycle(child, parent):
            raise InvalidValueError(f"{child} cannot be attached to {parent}, which is attached to {child}")
        if relation is None:
            relation = _freeze(inverse_pose(self.world(parent)) @ self.world(child))
        else:
            self.world(parent)
        return self._with_node(child, Node(parent=parent, relation=relation, rigid=rigid))

    def unfix(self, child: str) -> "FrameTree":
        """Return the tree with ``child`` detached: it keeps its pose and is attached to WORLD."""
        return self._with_node(child, Node(parent=WORLD, relation=self.world(child)))

    def _node(self, name: str) -> Node:
        try:
            return self.nodes[name]
        except KeyError:
            raise UnknownNameError("frame", name, [WORLD, *self.nodes]) from None

    def _attachment(self, name: str) -> tuple[str, Array]:
        node = self._node(name)
        if node.relation is None:
            raise InvalidValueError(f"frame {name} has no value yet")
        return node.parent, node.relation

    def _with_node(self, name: str, node: Node) -> "FrameTree":
        # Only descendants of a changed frame have other poses in the world.
        worlds = {} if self._children.get(name, 0) else {**self._worlds}
        worlds.pop(name, None)
        children = {**self._children}
        if (old := self.nodes.get(name)) is not None:
            children[old.parent] -= 1
        children[node.parent] = children.get(node.parent, 0) + 1
        return FrameTree({**self.nodes, name: node}, worlds, children)
