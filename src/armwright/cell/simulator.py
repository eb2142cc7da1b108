"""The kinematic simulator: a cell in which everything goes as the cell file says."""

import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError
from armwright.cell.model import Cell
from armwright.errors import closest
from armwright.motion.trajectory import Trajectory

# A trajectory must begin where the arm is; this is rounding [rad] or [m].
_SAME_POSTURE = 1e-9


class Simulator:
    """Arms that go where they are sent, fingers that close, tools that switch, a camera that answers in order."""

    def __init__(self, cell: Cell) -> None:
        """Set up the cell as it stands at the start."""
        self._cell = cell
        self._postures = {name: arm.start for name, arm in cell.arms.items()}
        self._on: set[str] = set()
        self._answers = {name: list(answers) for name, answers in cell.visions.items()}

    def posture(self, arm: str) -> Array:
        """Return the joint positions (n,) of an arm."""
        return self._postures[arm]

    def run(self, arm: str, trajectory: Trajectory) -> Array:
        """Move an arm along a trajectory; return the posture (n,) it ends in."""
        gap = np.abs(trajectory(0.0) - self._postures[arm]).max()
        assert gap <= _SAME_POSTURE, f"{arm} stands {gap:.3g} away from where its trajectory begins"  # noqa: S101
        end = trajectory(trajectory.duration)
        end.setflags(write=False)
        self._postures[arm] = end
        return end

    def fingers(self, arm: str, *, closed: bool) -> float:
        """Close or open the fingers of an arm; return the time it takes [s]."""
        return self._cell.arms[arm].grasp_time if closed else self._cell.arms[arm].open_time

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device.

        Raises:
            DeviceError: the cell file lists devices, and this is none of them.
        """
        devices = self._cell.devices
        if devices is not None and device not in devices:
            near = closest(device, devices)
            hint = f"; did you mean {near}?" if near else ""
            raise DeviceError(f"cell '{self._cell.name}' has no device {device}{hint}")
        (self._on.add if on else self._on.discard)(device)
        return 0.0

    def look(self, frame: str) -> tuple[Array, float]:
        """Return the next answer of the camera for a frame, in the world, and the time it takes.

        The answers of the cell file come one after the other; the last one stays.

        Raises:
            DeviceError: the cell file has no answer for this frame.
        """
        answers = self._answers.get(frame)
        if not answers:
            known = ", ".join(sorted(self._answers)) or "nothing"
            raise DeviceError(f"the camera found nothing for {frame}; in cell '{self._cell.name}' it finds {known}")
        seen = answers.pop(0) if len(answers) > 1 else answers[0]
        return self._cell.camera @ seen, self._cell.vision_time

    def running(self) -> frozenset[str]:
        """Return the devices that are on."""
        return frozenset(self._on)
