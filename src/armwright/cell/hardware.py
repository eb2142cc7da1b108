"""The protocol by which the interpreter controls a cell, simulated or real."""

from collections.abc import Callable
from typing import NamedTuple, Protocol, Self, TypeAlias, runtime_checkable

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.observations import Observations
from armwright.cell.part_poses import PartPoses
from armwright.errors import ArmwrightError
from armwright.motion.trajectory import Trajectory


class DeviceError(ArmwrightError, RuntimeError):
    """A device could not carry out its command."""


class PeakContact(NamedTuple):
    """The deepest contact of an arm during a motion.

    Attributes:
        depth: depth of penetration [m]; 0 without contact.
        force: contact force there [N].
        body: the name of the body of the scene; empty for the plane of contact.
    """

    depth: float
    force: float
    body: str = ""


class Mishap(NamedTuple):
    """Something that goes wrong in a cell between the statements of a program.

    Attributes:
        time: when [s], on a servo tick.
        arm: the arm it happens to; None where it is none.
        code: of the message, such as ``R605``.
        message: what happened.
        label: what is said at the statement under way.
        helps: what to do.
    """

    time: float
    arm: str | None
    code: str
    message: str
    label: str
    helps: tuple[str, ...] = ()


class Hardware(Protocol):
    """The devices of a cell. Times are in [s] on the clock of the cell, poses (4, 4) in the world."""

    def advance(self, now: float) -> Mishap | None:
        """Let time go by, until now or until something goes wrong; then the cell stands at the time of that."""

    def configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) that the sensors of an arm read."""

    def sent_configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) that an arm is sent to, now or at a time to come: motions begin there."""

    def start_motion(self, arm: str, trajectory: Trajectory, now: float, tip: Array, *, guarded: bool = False) -> None:
        """Let an arm follow a trajectory that begins where it has been sent, instead of its current motion.

        Args:
            arm: its name.
            trajectory: from now on.
            now: the time.
            tip: (4, 4) pose relative to the gripper of what is moved to the goal: the part that may touch something.
            guarded: whether the program looks out for contact meanwhile.
        """

    def contact_time(self, arm: str) -> float | None:
        """Return when the latest motion brings the arm, or what it moves, into contact; None without contact."""

    def excess_depth_time(self, arm: str) -> float | None:
        """Return the time of the first tick at which the latest motion is deeper than the cell allows; None if none is.

        Where the motion starts deeper already, the depth at its start is the bound.
        """

    def peak_contact(self, arm: str, now: float) -> PeakContact:
        """Return the deepest contact of the arm since its latest motion began, until now."""

    def contact_wrench(self, arm: str, now: float) -> Array:
        """Return the wrench (6,) that the sensor of forces of an arm reads, along the axes of the world.

        Force [N] and moment about the tool point [N m] on the tool and what it holds, less what was there when the
        sensor was zeroed.
        """

    def zero_force(self, arm: str, now: float) -> Array:
        """Let the wrench that the sensor of forces of an arm reads count as zero from now on.

        Returns:
            (6,) the wrench that counts as zero.
        """

    def tool_wrenches(self, arm: str, now: float) -> Array:
        """Return the contact wrenches on the tool of an arm, (k, 6), at this servo tick and the following ones.

        Force [N] and moment [N m] at the tool point, along the axes of the base, for the latest motion; the last wrench
        remains constant.
        """

    def move_fingers(
        self, arm: str, now: float, *, closed: bool, width: float | None = None, frame: str | None = None
    ) -> float:
        """Close or open the fingers of an arm; return the time it takes.

        Args:
            arm: its name.
            now: the time [s].
            closed: whether they close.
            width: to which they move [m]; None for as far as they can.
            frame: the frame that they close on, if the program says so.

        Raises:
            DeviceError: the gripper did not answer.
        """

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device; return the time it takes.

        Raises:
            DeviceError: there is no such device.
        """

    def set_output(self, device: str, value: float) -> None:
        """Set an analogue device to a number.

        Raises:
            DeviceError: there is no such device, or it can only be on or off.
        """

    def pulse(self, device: str, seconds: float) -> None:
        """Switch a device on for a time [s]; the program goes on meanwhile.

        Raises:
            DeviceError: there is no such device.
        """

    def read_output(self, device: str) -> float:
        """Return what a device is set to: 0 or 1 where it is off or on.

        Raises:
            DeviceError: there is no such device.
        """

    def read_input(self, name: str, *, analogue: bool) -> float:
        """Return an input: 0 or 1, or the number of an analogue one.

        Raises:
            DeviceError: there is no such input, or it is of the other kind.
        """

    def note_event(self, event: str) -> None:
        """Take note that the program signals an event now, on which an input of a simulated cell may depend."""

    def part_poses(self) -> PartPoses:
        """Return where the parts are believed to be, and on whose hands. It is not to be changed."""

    def locate(self, frame: str, now: float) -> tuple[Array, float]:
        """Let the camera locate the object of a frame; return its pose in the world and the time it takes.

        Raises:
            DeviceError: nothing was found.
        """

    def observations(self) -> Observations:
        """Return what the cell leaves of the run up to now."""

    def active_devices(self) -> frozenset[str]:
        """Return the devices that are on."""


@runtime_checkable
class SimulatedHardware(Hardware, Protocol):
    """Devices that are simulated: their state can be copied, so that a run can be gone back in."""

    def copy(self) -> Self:
        """Return devices in the same state; later commands to one do not change the other."""

    def input_at(self, name: str, time: float) -> float:
        """Return what an input of the cell is at a time that has been come to [s]."""

    def set_input(self, name: str, value: float, time: float | None = None) -> None:
        """Set an input by hand, as a switch in front of the cell does, from a time on [s], or from now on.

        Raises:
            DeviceError: there is no such input, or a digital one would be neither 0 nor 1.
        """


# How a cell is set up to run programs.
HardwareFactory: TypeAlias = Callable[[Cell], SimulatedHardware]
