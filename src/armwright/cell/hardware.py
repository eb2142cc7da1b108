"""What the interpreter asks of a cell: the one small protocol that a simulated or a real cell answers."""

from typing import NamedTuple, Protocol

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.motion.trajectory import Trajectory


class DeviceError(ArmwrightError, RuntimeError):
    """A device could not do what it was asked."""


class Press(NamedTuple):
    """How hard an arm has pressed on something.

    Attributes:
        depth: how deep what it moves has come into it [m]; 0 where it has not touched it.
        force: the force there [N].
    """

    depth: float
    force: float


class Hardware(Protocol):
    """A cell at work. Times are in [s] of the cell's own clock, poses (4, 4) in the world."""

    def configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) that the sensors of an arm read."""

    def begin(self, arm: str, trajectory: Trajectory, now: float, tip: Array) -> None:
        """Let an arm follow a trajectory that begins at its configuration, instead of what it does now.

        Args:
            arm: its name.
            trajectory: from now on.
            now: the time.
            tip: (4, 4) what shall come to the goal, seen from the gripper: the part that may touch something.
        """

    def touches_at(self, arm: str) -> float | None:
        """Return when what the arm moves comes into contact by the motion begun last; None where it does not."""

    def too_deep_at(self, arm: str) -> float | None:
        """Return the tick from which the motion begun last presses deeper than the cell allows; None if it never does.

        What stood deeper already when the motion began is too deep where it goes deeper still.
        """

    def pressed(self, arm: str, now: float) -> Press:
        """Return how deep and how hard the arm has pressed at most since its last motion began, until now."""

    def force(self, arm: str, now: float) -> Array:
        """Return the force (3,) on what the arm moves, or stands pressed with, along the axes of the world [N]."""

    def wrenches(self, arm: str, now: float) -> Array:
        """Return what pushes on the tool of an arm, (k, 6), on this servo tick and those after it; the last one stays.

        Force [N] and moment [N m] at the tool point, along the axes of the base, by the motion begun last.
        """

    def fingers(self, arm: str, *, closed: bool, width: float | None = None) -> float:
        """Close or open the fingers of an arm, wholly or to a width [m]; return the time it takes.

        Raises:
            DeviceError: the gripper did not answer.
        """

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device; return the time it takes.

        Raises:
            DeviceError: there is no such device.
        """

    def look(self, frame: str) -> tuple[Array, float]:
        """Let the camera search for what ``frame`` stands for; return its pose in the world and the time it takes.

        Raises:
            DeviceError: nothing was found.
        """

    def running(self) -> frozenset[str]:
        """Return the devices that are on."""
