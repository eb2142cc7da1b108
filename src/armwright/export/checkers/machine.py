"""What the machines of all languages share: a cell whose inputs they read, and the actions that they leave."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from armwright.arrays import Array
from armwright.export.checkers.actions import Action, CheckError, ReadProgram, TextAction

# A program that does more is taken to run for ever.
MOST_STEPS = 2_000_000


class World(Protocol):
    """The cell around a controller whose program is run.

    Attributes:
        step: the time that goes by in one wait [s].
    """

    step: float

    @property
    def now(self) -> float:
        """The time on its clock [s]."""

    def read(self, address: int | str, *, is_input: bool) -> bool:
        """Return whether an input or an output is on."""

    def passed(self, action: Action) -> None:
        """Take note of what the controller has done."""

    def wait(self) -> None:
        """Let a short time go by."""


class BreakLoop(Exception):  # noqa: N818 - no error
    """A loop is left."""


class ReturnValue(Exception):  # noqa: N818 - no error
    """A procedure is left, with the value of a function."""

    def __init__(self, value: Any) -> None:
        """Keep the value."""
        super().__init__()
        self.value = value


class EndProgram(Exception):  # noqa: N818 - no error
    """The program ends."""


class Machine(ABC):
    """A controller that runs a program: what it has done, and the variables that hold.

    Attributes:
        actions: in order.
        X_CT: (4, 4) tool, seen from the flange frame of the controller.
        variables: of the program.
        frames: variables of the procedures that are under way, the innermost last.
    """

    def __init__(self, world: World) -> None:
        """Stand in a cell, with no program."""
        self.world, self.actions, self.X_CT = world, list[Action](), np.eye(4)
        self.variables: dict[str, Any] = {}
        self.frames: list[dict[str, Any]] = []
        self._steps = 0

    def count_step(self, line: int) -> None:
        """Count a statement.

        Raises:
            CheckError: there are too many.
        """
        self._steps += 1
        if self._steps > MOST_STEPS:
            raise CheckError(f"line {line}: the program does not come to its end")

    def done(self, action: Action) -> None:
        """Take note of an action."""
        self.actions.append(action)
        if not isinstance(action, TextAction):
            self.world.passed(action)

    def lookup(self, name: str, line: int) -> Any:
        """Return what a variable holds.

        Raises:
            CheckError: there is none.
        """
        for variables in (*self.frames[-1:], self.variables):
            if name in variables:
                return variables[name]
        raise CheckError(f"line {line}: there is no variable {name}")

    @abstractmethod
    def value(self, node: Any) -> Any:
        """Return the value of an expression."""

    def truth(self, node: Any, line: int) -> bool:
        """Return the value of a condition.

        Raises:
            CheckError: it is none.
        """
        value = self.value(node)
        if not isinstance(value, bool):
            raise CheckError(f"line {line}: expected a condition")
        return value

    def _truths(self, nodes: Iterable[Any], line: int) -> list[bool]:
        """Return conditions, all of which are looked at."""
        return [self.truth(node, line) for node in nodes]

    def operation(self, node: Any) -> Any:
        """Return the value of an expression whose operation all languages have.

        Raises:
            CheckError: it is another one.
        """
        line, parts = node.meta.line, node.children
        match node.data:
            case "signed":
                value = self.value(parts[1])
                return -value if parts[0] == "-" else value
            case "comparison":
                left, operation, right = parts
                return compared(str(operation), self.value(left), self.value(right), line)
            case "not":
                return not self.truth(parts[0], line)
            case "conjunction":
                return all(self._truths(parts, line))
            case "disjunction" if {str(one).upper() for one in parts[1::2]} == {"OR"}:
                return any(self._truths(parts[::2], line))
        raise CheckError(f"line {line}: the machine does not know this value ({node.data})")

    def read_program(self, name: str) -> ReadProgram:
        """Return what has been done."""
        return ReadProgram(name=name, X_CT=self.X_CT, actions=tuple(self.actions))


def arithmetic(operation: str, a: float, b: float, line: int) -> float:
    """Return a sum, difference, product or quotient.

    Raises:
        CheckError: it is divided by zero.
    """
    if operation == "/" and b == 0:
        raise CheckError(f"line {line}: divided by 0")
    functions: Mapping[str, Callable[[float, float], float]] = {
        "+": lambda a, b: a + b,
        "-": lambda a, b: a - b,
        "*": lambda a, b: a * b,
        "/": lambda a, b: a / b,
    }
    if operation not in functions:
        raise CheckError(f"line {line}: the checker does not know {operation}")
    return functions[operation](a, b)


def compared(operation: str, a: Any, b: Any, line: int) -> bool:
    """Return the result of a comparison.

    Raises:
        CheckError: there is no such comparison.
    """
    equal, less = a == b, a < b
    results = {"==": equal, "=": equal, "!=": not equal, "<>": not equal, "<": less, ">": not less and not equal}
    results |= {"<=": less or equal, ">=": not less}
    if operation not in results:
        raise CheckError(f"line {line}: the checker does not know {operation}")
    return bool(results[operation])


def pose_of(R: Array, place: Array) -> Array:
    """Return a pose (4, 4)."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, place
    return X


def rotation_vector_of(X: Array) -> Array:
    """Return the rotation vector (3,) of a pose, by SciPy [rad]."""
    return np.asarray(Rotation.from_matrix(X[:3, :3]).as_rotvec())


def angles_of(X: Array) -> tuple[float, float, float]:
    """Return the angles A, B, C about Z, the new Y and the new X of a pose [deg]; C is 0 where B is a quarter turn."""
    level = math.hypot(X[0, 0], X[1, 0])
    b = math.degrees(math.atan2(-X[2, 0], level))
    if level < 1e-12:
        return math.degrees(math.atan2(-X[0, 1], X[1, 1])), b, 0.0
    a = math.atan2(X[1, 0], X[0, 0])
    rest = Rotation.from_euler("Z", -a).as_matrix() @ X[:3, :3]
    return math.degrees(a), b, math.degrees(math.atan2(-rest[1, 2], rest[1, 1]))
