"""The frame tree: where everything is, and what hangs on what. A tree never changes; a change gives a new one."""

from collections.abc import Iterator, Mapping

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.spatial.poses import inverse

WORLD = "WORLD"


def _relation(value: ArrayLike) -> Array:
    return of_shape(value, (4, 4), "relation")


@attrs.frozen(kw_only=True, eq=False)
class Node:
    """One frame.

    Attributes:
        parent: the frame it hangs on.
        relation: (4, 4) its pose seen from the parent; None while the frame has no value.
    """

    parent: str
    relation: Array | None = attrs.field(converter=attrs.converters.optional(_relation))


@attrs.frozen(eq=False)
class FrameTree:
    """Frames by name, each with one parent, the root of all WORLD.

    Attributes:
        nodes: every frame but WORLD.
    """

    nodes: Mapping[str, Node] = attrs.field(factory=dict)

    def __contains__(self, name: str) -> bool:
        """Whether a frame of that name is known."""
        return name == WORLD or name in self.nodes

    def __iter__(self) -> Iterator[str]:
        """Walk through the names, parents before children."""
        done = {WORLD}
        yield WORLD
        waiting = list(self.nodes)
        while waiting:
            ready = [name for name in waiting if self.nodes[name].parent in done]
            yield from ready
            done.update(ready)
            waiting = [name for name in waiting if name not in done]

    def has_value(self, name: str) -> bool:
        """Whether the frame stands somewhere."""
        while name != WORLD:
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
        return self.relation(name, WORLD)

    def relation(self, child: str, ancestor: str) -> Array:
        """Return the pose (4, 4) of ``child`` seen from ``ancestor``, one of the frames it hangs on.

        Raises:
            UnknownNameError: no such frame.
            InvalidValueError: the frame, or one it hangs on, has no value yet.
        """
        X = np.eye(4)
        name = child
        while name != ancestor:
            node = self._node(name)
            if node.relation is None:
                raise InvalidValueError(f"frame {name} has no value yet")
            X = node.relation @ X
            name = node.parent
        return X

    def declare(self, name: str) -> "FrameTree":
        """Return the tree with a frame that hangs on WORLD and has no value yet; a known frame stays as it is."""
        return self if name in self else self._with(name, Node(parent=WORLD, relation=None))

    def place(self, name: str, X_WF: ArrayLike) -> "FrameTree":
        """Return the tree with a frame set to a pose in the world; it goes on hanging on what it hung on."""
        if name == WORLD:
            raise InvalidValueError("the frame WORLD is the root and cannot be placed")
        parent = self.nodes[name].parent if name in self.nodes else WORLD
        return self._with(
            name, Node(parent=parent, relation=inverse(self.world(parent)) @ of_shape(X_WF, (4, 4), "pose"))
        )

    def affix(self, child: str, parent: str, relation: ArrayLike | None = None) -> "FrameTree":
        """Return the tree with ``child`` hanging on ``parent``.

        Args:
            child: the frame that follows.
            parent: the frame it follows.
            relation: (4, 4) pose of the child seen from the parent; where both stand now when left out.

        Raises:
            UnknownNameError: no such frame.
            InvalidValueError: a ring would close, or a pose that is needed has no value.
        """
        if child == parent or child in self.ancestors(parent):
            raise InvalidValueError(f"{child} cannot hang on {parent}, which hangs on {child}")
        if relation is None:
            relation = inverse(self.world(parent)) @ self.world(child)
        else:
            self.world(parent)
        return self._with(child, Node(parent=parent, relation=relation))

    def unfix(self, child: str) -> "FrameTree":
        """Return the tree with ``child`` cut loose: it keeps its place and hangs on WORLD."""
        return self._with(child, Node(parent=WORLD, relation=self.world(child)))

    def _node(self, name: str) -> Node:
        try:
            return self.nodes[name]
        except KeyError:
            raise UnknownNameError("frame", name, [WORLD, *self.nodes]) from None

    def _with(self, name: str, node: Node) -> "FrameTree":
        return FrameTree({**self.nodes, name: node})
