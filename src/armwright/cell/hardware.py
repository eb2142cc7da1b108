"""What the interpreter asks of a cell: the one small protocol that a simulated or a real cell answers."""

from typing import Protocol

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.motion.trajectory import Trajectory


class DeviceError(ArmwrightError, RuntimeError):
    """A device could not do what it was asked."""


class Hardware(Protocol):
    """A cell at work. Times are in [s] of the cell's own clock, poses (4, 4) in the world."""

    def posture(self, arm: str) -> Array:
        """Return the joint positions (n,) that the sensors of an arm read."""

    def run(self, arm: str, trajectory: Trajectory) -> Array:
        """Move an arm along a trajectory that begins at its posture; return the posture (n,) it ends in."""

    def fingers(self, arm: str, *, closed: bool) -> float:
        """Close or open the fingers of an arm; return the time it takes.

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
