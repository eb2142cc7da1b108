"""The kinematic simulator: a cell in which everything goes as the cell file says."""

import attrs
import numpy as np
from scipy.optimize import brentq

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError
from armwright.cell.model import Cell
from armwright.errors import closest
from armwright.kinematics.forward import forward
from armwright.motion.trajectory import Trajectory, hold

# A trajectory must begin where the arm is; this is rounding [rad] or [m].
_SAME_POSTURE = 1e-9
# What is less deep in the plane than this only touches it, as after a motion that ended on it [m].
_TOUCHES = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class _Run:
    """What an arm does since some time: along a trajectory until something stops it."""

    t0: float
    trajectory: Trajectory
    tip: Array
    stopped: float | None

    def local(self, now: float) -> float:
        """Return the time along the trajectory that the arm has come to."""
        end = self.trajectory.duration if self.stopped is None else self.stopped
        return min(max(0.0, now - self.t0), end)


class Simulator:
    """Arms that go where they are sent, fingers that close, tools that switch, a camera that answers in order.

    Where the cell has a plane of contact, what an arm moves cannot come below it: the arm stands still while its
    trajectory goes on into the plane, and the force grows with the depth that it has been sent to.
    """

    def __init__(self, cell: Cell) -> None:
        """Set up the cell as it stands at the start."""
        self._cell = cell
        self._runs = {
            name: _Run(t0=0.0, trajectory=hold(arm.start, 0.0), tip=np.eye(4), stopped=None)
            for name, arm in cell.arms.items()
        }
        self._on: set[str] = set()
        self._answers = {name: list(answers) for name, answers in cell.visions.items()}

    def twin(self) -> "Simulator":
        """Return a simulator in the same state; what one of them does from now on does not change the other."""
        other = Simulator(self._cell)
        other._runs, other._on = dict(self._runs), set(self._on)
        other._answers = {name: list(answers) for name, answers in self._answers.items()}
        return other

    def posture(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) of an arm."""
        run = self._runs[arm]
        return run.trajectory(run.local(now))

    def begin(self, arm: str, trajectory: Trajectory, now: float, tip: Array) -> None:
        """Let an arm follow a trajectory that begins at its posture."""
        gap = np.abs(trajectory(0.0) - self.posture(arm, now)).max()
        assert gap <= _SAME_POSTURE, f"{arm} stands {gap:.3g} away from where its trajectory begins"  # noqa: S101
        stopped = self._contact(arm, trajectory, tip)
        self._runs[arm] = _Run(t0=now, trajectory=trajectory, tip=tip, stopped=stopped)

    def stopped_at(self, arm: str) -> float | None:
        """Return when the plane stops the motion of an arm; None where it does not."""
        run = self._runs[arm]
        return None if run.stopped is None else run.t0 + run.stopped

    def force(self, arm: str, now: float) -> Array:
        """Return the force of the plane on what an arm moves [N]: upwards, as deep as it has been sent."""
        run = self._runs[arm]
        if run.stopped is None or now - run.t0 <= run.stopped:
            return np.zeros(3)
        sent = self._heights(arm, run.trajectory, run.tip, np.array([now - run.t0]))[0]
        assert self._cell.contact_height is not None  # noqa: S101 - nothing else stops an arm
        depth = max(0.0, self._cell.contact_height - sent)
        return np.array([0.0, 0.0, depth * self._cell.contact_stiffness])

    def _contact(self, arm: str, trajectory: Trajectory, tip: Array) -> float | None:
        """Return when what an arm moves comes down on the plane; None where it does not, or is below it already."""
        plane = self._cell.contact_height
        if plane is None or trajectory.duration == 0:
            return None
        looks = np.arange(max(2, round(trajectory.duration / self._cell.period) + 1)) * self._cell.period
        above = self._heights(arm, trajectory, tip, np.minimum(looks, trajectory.duration)) - plane
        into = np.flatnonzero((above[1:] < -_TOUCHES) & (above[:-1] >= -_TOUCHES))
        if not len(into):
            return None
        at = int(into[0])
        if above[at] <= 0:
            return float(looks[at])
        height = lambda t: float(self._heights(arm, trajectory, tip, np.array([t]))[0]) - plane  # noqa: E731
        return float(brentq(height, looks[at], min(looks[at + 1], trajectory.duration), xtol=1e-14))

    def _heights(self, arm: str, trajectory: Trajectory, tip: Array, t: Array) -> Array:
        place = self._cell.arms[arm]
        return np.asarray((place.base @ forward(place.arm, trajectory(t)) @ tip)[:, 2, 3])

    def fingers(self, arm: str, *, closed: bool, width: float | None = None) -> float:  # noqa: ARG002 - see below
        """Close or open the fingers of an arm; return the time it takes [s].

        The fingers of this simulator have one speed whatever the width: the file gives one time.
        """
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
