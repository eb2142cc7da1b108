"""Values in words, as PRINT, the trace and the events show them."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD, FrameTree
from armwright.program.language.units import UnitSystem
from armwright.program.vm.process import Value
from armwright.spatial.poses import to_noap

# What is nearer to 0 than this is rounding.
_ROUNDING = 1e-12


def value_text(value: Value, units: UnitSystem) -> str:
    """Return a value for people: numbers to six digits, poses with lengths in the units of the program.

    Args:
        value: a number, a truth value, a text, a pose or a step.
        units: of the program.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float | int):
        return f"{value + 0.0:.6g}"
    assert isinstance(value, np.ndarray)  # noqa: S101 - elements have been read
    return matrix_text(noap_texts(value, units))


def noap_texts(X: Array, units: UnitSystem, digits: int = 6, rounding: float = _ROUNDING) -> list[str]:
    """Return the numbers n, o, a, p (12,) of a pose as texts, lengths in the unit of the program.

    Args:
        X: (4, 4) a pose.
        units: of the program.
        digits: significant digits.
        rounding: smaller numbers are 0.
    """
    numbers = to_noap(X)
    numbers[9:] /= units.metres
    return [f"{0.0 if abs(number) < rounding else number:.{digits}g}" for number in numbers.tolist()]


def matrix_text(texts: Sequence[str]) -> str:
    """Return the twelve numbers of a pose as a program writes them."""
    return "(" + ", ".join(",".join(texts[i : i + 3]) for i in range(0, 12, 3)) + ")"


def frames_with_depth(tree: FrameTree, sort: Callable[[Iterable[str]], list[str]] = list) -> Iterator[tuple[str, int]]:
    """Give each frame with its depth in the tree, each behind its parent; an arm is shown in place of its base.

    Args:
        tree: the frames.
        sort: puts the frames on one parent in order.
    """
    children: dict[str, list[str]] = {}
    for name, node in tree.nodes.items():
        if not name.endswith(".BASE"):
            parent = node.parent
            children.setdefault(tree.parent(parent) or WORLD if parent.endswith(".BASE") else parent, []).append(name)
    stack = [(WORLD, 0)]
    while stack:
        name, depth = stack.pop()
        yield name, depth
        stack += [(child, depth + 1) for child in reversed(sort(children.get(name, ())))]
