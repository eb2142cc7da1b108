"""The kinematic simulator: a cell in which everything goes as the cell file says."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError, Press
from armwright.cell.model import Cell
from armwright.errors import closest
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.trajectory import Trajectory, hold

# A trajectory must begin where the arm is; this is rounding [rad] or [m].
_SAME_CONFIGURATION = 1e-9
# What is less deep in the plane than this only touches it, as after a motion that ended on it [m].
_TOUCHES = 1e-9
# Configurations that are worked out together.
_AT_ONCE = 16384


@attrs.frozen(kw_only=True, eq=False)
class _Tip:
    """What may press on the plane while an arm follows a trajectory.

    Attributes:
        pose: (4, 4) seen from the gripper.
        above: (k,) its heights above the plane on the servo ticks [m].
        since: the first tick from which it counts; before, it stands below the plane without having come down on it.
    """

    pose: Array
    above: Array
    since: int

    def depths(self) -> Array:
        """Return how deep it presses on every tick [m]."""
        return np.where(np.arange(len(self.above)) < self.since, 0.0, np.maximum(-self.above, 0.0))

    def comes_down(self) -> int | None:
        """Return the last tick before it comes down on the plane; None where it does not."""
        into = (self.above[1:] < -_TOUCHES) & (self.above[:-1] >= -_TOUCHES)
        return int(into.argmax()) if into.any() else None


@attrs.frozen(kw_only=True, eq=False)
class _Run:
    """What an arm does since some time: along a trajectory, with tips that may press on the plane."""

    t0: float
    trajectory: Trajectory
    tips: tuple[_Tip, ...] = ()

    def local(self, now: float) -> float:
        """Return the time along the trajectory that the arm has come to."""
        return min(max(0.0, now - self.t0), self.trajectory.duration)

    def depths(self) -> Array:
        """Return how deep it presses on every servo tick [m]."""
        return np.max([tip.depths() for tip in self.tips], axis=0) if self.tips else np.zeros(1)


class Simulator:
    """Arms that go where they are sent, fingers that close, tools that switch, a camera that answers in order.

    Where the cell has a plane of contact, it yields to what an arm brings down on it, with a force that grows with
    the depth, for as long as the arm stands or moves in it.
    """

    def __init__(self, cell: Cell) -> None:
        """Set up the cell as it stands at the start."""
        self._cell = cell
        self._runs = {name: _Run(t0=0.0, trajectory=hold(arm.start, 0.0)) for name, arm in cell.arms.items()}
        self._on: set[str] = set()
        self._answers = {name: list(answers) for name, answers in cell.visions.items()}

    def copy(self) -> "Simulator":
        """Return a simulator in the same state; what one of them does from now on does not change the other."""
        other = Simulator(self._cell)
        other._runs, other._on = dict(self._runs), set(self._on)
        other._answers = {name: list(answers) for name, answers in self._answers.items()}
        return other

    def configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) of an arm."""
        run = self._runs[arm]
        return run.trajectory(run.local(now))

    def begin(self, arm: str, trajectory: Trajectory, now: float, tip: Array) -> None:
        """Let an arm follow a trajectory that begins at its configuration."""
        gap = np.abs(trajectory(0.0) - self.configuration(arm, now)).max()
        assert gap <= _SAME_CONFIGURATION, f"{arm} stands {gap:.3g} away from where its trajectory begins"  # noqa: S101
        pressing = [tip.pose for tip in self._runs[arm].tips if self._depth(arm, tip, now) > _TOUCHES]
        self._runs[arm] = _Run(t0=now, trajectory=trajectory, tips=self._tips(arm, trajectory, tip, pressing))

    def touches_at(self, arm: str) -> float | None:
        """Return when what an arm moves comes down on the plane by the motion begun last; None where it does not."""
        run = self._runs[arm]
        ticks = ((tip, tip.comes_down()) for tip in run.tips)
        times = [self._touch(arm, run.trajectory, tip.pose, tick) for tip, tick in ticks if tick is not None]
        return run.t0 + min(times) if times else None

    def too_deep_at(self, arm: str) -> float | None:
        """Return the tick from which the motion begun last presses deeper than the cell allows; None where it does not.

        What stood deeper already when the motion began is too deep where it goes deeper still.
        """
        run = self._runs[arm]
        depths = run.depths()
        deep = depths > max(self._cell.contact.deepest, depths[0]) + _TOUCHES
        return run.t0 + int(deep.argmax()) * self._cell.period if deep.any() else None

    def pressed(self, arm: str, now: float) -> Press:
        """Return how deep and how hard an arm has pressed at most since its last motion began, until now."""
        run = self._runs[arm]
        passed = round(run.local(now) / self._cell.period) + 1
        depth = float(run.depths()[:passed].max())
        return Press(depth, depth * self._cell.contact.stiffness)

    def force(self, arm: str, now: float) -> Array:
        """Return the force of the plane on what an arm moves or stands pressed with [N]: upwards, by its depth."""
        depth = max((self._depth(arm, tip, now) for tip in self._runs[arm].tips), default=0.0)
        return np.array([0.0, 0.0, depth * self._cell.contact.stiffness])

    def wrenches(self, arm: str, now: float) -> Array:
        """Return what the plane does to the tool of an arm, (k, 6), on this servo tick and those after it.

        Force [N] and moment [N m] at the tool point, along the axes of the base; the last one stays. The plane pushes
        on what is deepest in it.
        """
        run, place, period = self._runs[arm], self._cell.arms[arm], self._cell.period
        if not run.depths().any():
            return np.zeros((1, 6))
        depths = np.stack([tip.depths() for tip in run.tips])[:, round(run.local(now) / period) :]
        found, deepest = np.zeros((depths.shape[1], 6)), depths.argmax(axis=0)
        for ticks in _chunks(np.flatnonzero(depths.any(axis=0))):
            t = np.minimum(run.local(now) + ticks * period, run.trajectory.duration)
            levers = np.stack([tip.pose[:3, 3] for tip in run.tips])[deepest[ticks]]
            arms = (forward(place.arm, run.trajectory(t))[:, :3, :3] @ levers[..., None])[..., 0]
            up = place.base[2, :3] * (depths.max(axis=0)[ticks] * self._cell.contact.stiffness)[:, None]
            found[ticks] = np.concatenate([up, np.cross(arms, up)], axis=1)
        return found

    def _depth(self, arm: str, tip: _Tip, now: float) -> float:
        """Return how deep one tip presses on the plane [m]."""
        local, period, plane = self._runs[arm].local(now), self._cell.period, self._cell.contact.height
        if plane is None or local < tip.since * period - _TOUCHES:
            return 0.0
        tick = round(local / period)
        if abs(local - tick * period) <= _TOUCHES and tick < len(tip.above):
            # A guard asks on every tick, and there the height is known.
            return max(0.0, -float(tip.above[tick]))
        return max(0.0, plane - float(self._heights(arm, self._runs[arm].trajectory, tip.pose, np.array([local]))[0]))

    def _tips(self, arm: str, trajectory: Trajectory, tip: Array, pressing: Sequence[Array]) -> tuple[_Tip, ...]:
        """Return what may press on the plane: what the arm shall bring to the goal, and what it is pressed with now."""
        plane = self._cell.contact.height
        if plane is None:
            return ()
        ticks = np.arange(round(trajectory.duration / self._cell.period) + 1)
        t = np.minimum(ticks * self._cell.period, trajectory.duration)
        others = [pose for pose in pressing if not np.allclose(pose, tip, rtol=0, atol=_TOUCHES)]
        tips = []
        for pose, pressed in ((tip, len(others) < len(pressing)), *((other, True) for other in others)):
            above = self._heights(arm, trajectory, pose, t) - plane
            over = above >= -_TOUCHES
            since = 0 if pressed else int(over.argmax()) if over.any() else len(over)
            tips.append(_Tip(pose=pose, above=above, since=since))
        return tuple(tips)

    def _touch(self, arm: str, trajectory: Trajectory, tip: Array, tick: int) -> float:
        """Return when a tip that is below the plane on the next tick comes to it."""
        begin, end = tick * self._cell.period, min((tick + 1) * self._cell.period, trajectory.duration)
        plane = self._cell.contact.height
        assert plane is not None  # noqa: S101 - nothing else is touched

        def above(t: float) -> float:
            return float(self._heights(arm, trajectory, tip, np.array([t]))[0]) - plane

        if above(begin) <= 0:
            return begin
        from scipy.optimize import brentq  # noqa: PLC0415 - half of what a run would import, and few touch anything

        return float(brentq(above, begin, end, xtol=1e-14))

    def _heights(self, arm: str, trajectory: Trajectory, tip: Array, t: Array) -> Array:
        place = self._cell.arms[arm]
        heights = [(place.base @ forward(place.arm, trajectory(piece)) @ tip)[:, 2, 3] for piece in _chunks(t)]
        return np.concatenate(heights)

    def fingers(self, arm: str, *, closed: bool, width: float | None = None) -> float:  # noqa: ARG002 - see below
        """Close or open the fingers of an arm; return the time it takes [s].

        The fingers of this simulator have one speed whatever the width: the file gives one time. What they release does
        not press any more.
        """
        if not closed:
            run = self._runs[arm]
            own = tuple(tip for tip in run.tips if np.allclose(tip.pose, np.eye(4), rtol=0, atol=_TOUCHES))
            self._runs[arm] = attrs.evolve(run, tips=own)
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

        The answers of the cell file come one after the other; where it says so, the last one stays.

        Raises:
            DeviceError: the cell file has no answer for this frame, or no more.
        """
        answers = self._answers.get(frame)
        if not answers:
            if told := len(self._cell.visions.get(frame, ())):
                count = "1 answer" if told == 1 else f"{told} answers"
                raise DeviceError(
                    f"the camera found nothing more for {frame}: cell '{self._cell.name}' has {count} for it; "
                    'with `after_last = "same"` under [camera] the last one stays'
                )
            known = ", ".join(sorted(self._answers)) or "nothing"
            raise DeviceError(f"the camera found nothing for {frame}; in cell '{self._cell.name}' it finds {known}")
        last = self._cell.camera_repeats and len(answers) == 1
        seen = answers[0] if last else answers.pop(0)
        return self._cell.camera @ seen, self._cell.vision_time

    def running(self) -> frozenset[str]:
        """Return the devices that are on."""
        return frozenset(self._on)


def _chunks(values: np.ndarray) -> list[np.ndarray]:
    """Cut values into pieces that are worked out together."""
    return np.array_split(values, max(1, -(-len(values) // _AT_ONCE)))
