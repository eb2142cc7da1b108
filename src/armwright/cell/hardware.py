"""What the interpreter asks of a cell: the one small protocol that a simulated or a real cell answers."""

from typing import Protocol

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.motion.trajectory import Trajectory


class DeviceError(ArmwrightError, RuntimeError):
    """A device could not do what it was asked."""


class Hardware(Protocol):
    """A cell at work. Times are in [s] of the cell's own clock, poses (4, 4) in the world."""

    def posture(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) that the sensors of an arm read."""

    def begin(self, arm: str, trajectory: Trajectory, now: float, tip: Array) -> None:
        """Let an arm follow a trajectory that begins at its posture, in place of what it does now.

        Args:
            arm: its name.
            trajectory: from now on.
            now: the time.
            tip: (4, 4) what shall come to the goal, seen from the hand: the part that may touch something.
        """

    def stopped_at(self, arm: str) -> float | None:
        """Return when something in the way stops the motion that was begun last; None where nothing does."""

    def force(self, arm: str, now: float) -> Array:
        """Return the force (3,) on what the arm moves, along the axes of the world [N]."""

    def fingers(self, arm: str, *, closed: bool, width: float | None = None) -> float:
        """Close or open the fingers of an arm, wholly or to a width [m]; return the time it takes.

        Raises:
            DeviceError: the hand did not answer.
        """

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device; return the time it takes.

        Raises:
            DeviceError: there is no such device.
        """

    def look(self, frame: str) -> tuple[Array, float]:
        """Let the camera look for what ``frame`` stands for; return its pose in the world and the time it takes.

        Raises:
            DeviceError: nothing was found.
        """

    def running(self) -> frozenset[str]:
        """Return the devices that are on."""
