"""The kinematic simulator: a cell that behaves as its file states."""

import math
from collections.abc import Sequence
from itertools import compress

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.contact_course import ContactCourse, SceneContacts
from armwright.cell.hardware import DeviceError, PeakContact
from armwright.cell.model import Cell
from armwright.cell.observations import Observations
from armwright.cell.part_poses import PartPoses
from armwright.cell.signals import Signals
from armwright.errors import closest, counted
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.trajectory import Trajectory, hold

# Largest difference of a trajectory's start from the configuration of the arm, by rounding [rad] or [m].
_SAME_CONFIGURATION = 1e-9
# A smaller depth in the plane is a touch, as after a motion that ended on it [m].
_DEPTH_TOLERANCE = 1e-9
# Configurations that are computed together.
_BLOCK = 16384


@attrs.frozen(kw_only=True, eq=False)
class _ContactPoint:
    """A point that may press on the plane while an arm follows a trajectory.

    Attributes:
        pose: (4, 4) pose relative to the gripper.
        above: (k,) its heights above the plane at the servo ticks [m].
        first_tick: tick from which its contact counts; before, it is below the plane without having come down on it.
    """

    pose: Array
    above: Array
    first_tick: int

    def depths(self) -> Array:
        """Return its depth in the plane at every tick [m]."""
        return np.where(np.arange(len(self.above)) < self.first_tick, 0.0, np.maximum(-self.above, 0.0))

    def tick_before_contact(self) -> int | None:
        """Return the last tick before it comes down on the plane; None where it does not."""
        into = (self.above[1:] < -_DEPTH_TOLERANCE) & (self.above[:-1] >= -_DEPTH_TOLERANCE)
        return int(into.argmax()) if into.any() else None


@attrs.frozen(kw_only=True, eq=False)
class _Motion:
    """The motion of an arm since a time ``t0``: its trajectory, and points that may press on the plane."""

    t0: float
    trajectory: Trajectory
    points: tuple[_ContactPoint, ...] = ()

    def trajectory_time(self, now: float) -> float:
        """Return the time on the clock of the trajectory."""
        return min(max(0.0, now - self.t0), self.trajectory.duration)

    def depths(self) -> Array:
        """Return the depth of the deepest point at every servo tick [m]."""
        return np.max([point.depths() for point in self.points], axis=0) if self.points else np.zeros(1)


class Simulator:
    """Simulated arms, fingers, devices, and a camera that gives the answers of the cell file in order.

    A contact plane of the cell yields to what an arm brings down on it, with a force proportional to the depth, as
    long as the arm is in it. So does what stands in a cell without such a plane, in motions that a force may end.
    """

    def __init__(self, cell: Cell, scene: SceneContacts | None = None, *, follows_plans: bool = True) -> None:
        """Set up the initial state of the cell.

        Args:
            cell: the cell.
            scene: what stands in it, where a tool is to press on that.
            follows_plans: whether arms are where they are sent to; otherwise zones are told by ``note_tool``.
        """
        self._cell, self._scene, self._follows_plans = cell, scene, follows_plans
        self._courses: dict[str, ContactCourse] = {}
        self._motions = {name: _Motion(t0=0.0, trajectory=hold(arm.start, 0.0)) for name, arm in cell.arms.items()}
        self._signals = Signals(cell.inputs)
        self._answers = {name: list(answers) for name, answers in cell.visions.items()}
        self._parts = PartPoses(cell)
        # Wrenches that the sensors of forces take for zero.
        self._zeros: dict[str, Array] = {}
        for name, motion in self._motions.items():
            self._note_zones(name, motion.trajectory, 0.0)

    def copy(self) -> "Simulator":
        """Return a simulator in the same state; later commands to one do not change the other."""
        other = Simulator(self._cell, self._scene, follows_plans=self._follows_plans)
        other._courses = dict(self._courses)
        other._motions, other._signals = dict(self._motions), self._signals.copy()
        other._answers = {name: list(answers) for name, answers in self._answers.items()}
        other._parts, other._zeros = self._parts.copy(), dict(self._zeros)
        return other

    def advance(self, now: float) -> None:
        """Let time go by: in this cell nothing goes wrong."""
        self._signals.now = now

    def configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) of an arm."""
        motion = self._motions[arm]
        return motion.trajectory(motion.trajectory_time(now))

    def sent_configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) of an arm: it is where it is sent to."""
        return self.configuration(arm, now)

    def start_motion(
        self,
        arm: str,
        trajectory: Trajectory,
        now: float,
        tip: Array,
        *,
        guarded: bool = False,
    ) -> None:
        """Let an arm follow a trajectory that begins at its configuration."""
        gap = np.abs(trajectory(0.0) - self.configuration(arm, now)).max()
        assert gap <= _SAME_CONFIGURATION, f"{arm} is {gap:.3g} away from the start of its trajectory"  # noqa: S101
        points = self._motions[arm].points
        pressed = [point.pose for point in points if self._depth(arm, point, now) > _DEPTH_TOLERANCE]
        points = self._contact_points(arm, trajectory, tip, pressed)
        self._motions[arm] = _Motion(t0=now, trajectory=trajectory, points=points)
        self._press_on_scene(arm, now, trajectory, guarded=guarded)
        if self._follows_plans:
            self._note_zones(arm, trajectory, now)

    def _ticks(self, trajectory: Trajectory) -> Array:
        """Return the times of the servo ticks of a trajectory [s]."""
        ticks = np.arange(round(trajectory.duration / self._cell.period) + 1)
        return np.asarray(np.minimum(ticks * self._cell.period, trajectory.duration))

    def _note_zones(self, arm: str, trajectory: Trajectory, start: float) -> None:
        """Let the zones of an arm know the trajectory that it follows from a time on."""
        if any(source.zone is not None and source.zone.arm == arm for source in self._cell.inputs.values()):
            known = self._cell.arms[arm]
            times = _split_blocks(self._ticks(trajectory))
            blocks = (known.base @ forward(known.arm, trajectory(block)) for block in times)
            self.note_tool(arm, np.concatenate([poses[:, :3, 3] for poses in blocks]), start)

    def note_tool(self, arm: str, p: Array, start: float) -> None:
        """Let the zones of an arm know positions (k, 3) of its tool in the world at the servo ticks from a time on."""
        for name, source in self._cell.inputs.items():
            if source.zone is not None and source.zone.arm == arm:
                self._signals.note_zone(name, source.zone.changes(p, start, self._cell.period))

    def _press_on_scene(self, arm: str, now: float, trajectory: Trajectory, *, guarded: bool) -> None:
        """See what a tool presses on from now on; without a guard only what it presses on already counts."""
        course = self._courses.pop(arm, None)
        pressed = frozenset() if course is None else course.at(now, self._cell.period).pairs
        if self._scene is not None and (guarded or pressed):
            self._courses[arm] = self._scene.along(arm, trajectory, now, self._parts, guarded=guarded, pressed=pressed)

    def contact_time(self, arm: str) -> float | None:
        """Return when the latest motion of an arm comes down on the plane or the scene; None where it does not."""
        if arm in self._courses:
            return self._courses[arm].first_contact
        motion = self._motions[arm]
        times = [
            self._find_contact_time(arm, motion.trajectory, point.pose, tick)
            for point in motion.points
            if (tick := point.tick_before_contact()) is not None
        ]
        return motion.t0 + min(times) if times else None

    def excess_depth_time(self, arm: str) -> float | None:
        """Return the time of the first tick at which the latest motion is deeper than the cell allows; None if none is.

        Where the motion starts deeper already, the depth at its start is the bound.
        """
        motion, course = self._motions[arm], self._courses.get(arm)
        if course is not None:
            return None if course.excess_tick is None else course.t0 + course.excess_tick * self._cell.period
        depths = motion.depths()
        deep = depths > max(self._cell.contact.max_depth, depths[0]) + _DEPTH_TOLERANCE
        return motion.t0 + int(deep.argmax()) * self._cell.period if deep.any() else None

    def peak_contact(self, arm: str, now: float) -> PeakContact:
        """Return the deepest contact of an arm since its latest motion began, until now."""
        if arm in self._courses:
            deepest = self._courses[arm].deepest(now, self._cell.period)
            return PeakContact(deepest.depth, deepest.depth * self._cell.contact.stiffness, deepest.body)
        motion = self._motions[arm]
        passed = round(motion.trajectory_time(now) / self._cell.period) + 1
        depth = float(motion.depths()[:passed].max())
        return PeakContact(depth, depth * self._cell.contact.stiffness)

    def contact_wrench(self, arm: str, now: float) -> Array:
        """Return the wrench (6,) of the plane on an arm and what it moves, less that of ``zero_force``.

        Force [N], upwards and proportional to the depth, and its moment about the tool point [N m].
        """
        return self._wrench(arm, now) - self._zeros.get(arm, 0.0)

    def zero_force(self, arm: str, now: float) -> Array:
        """Let the present wrench count as zero from now on; return it (6,)."""
        self._zeros[arm] = self._wrench(arm, now)
        return self._zeros[arm]

    def _wrench(self, arm: str, now: float) -> Array:
        if arm in self._courses:
            return self._courses[arm].at(now, self._cell.period).wrench
        points = self._motions[arm].points
        depths = [self._depth(arm, point, now) for point in points]
        if not any(depths):
            return np.zeros(6)
        deepest = int(np.argmax(depths))
        force = np.array([0.0, 0.0, depths[deepest] * self._cell.contact.stiffness])
        lever = self._carriers(now)[arm][:3, :3] @ points[deepest].pose[:3, 3]
        return np.concatenate([force, np.cross(lever, force)])

    def tool_wrenches(self, arm: str, now: float) -> Array:
        """Return the wrenches of the plane on the tool of an arm, (k, 6), at this servo tick and the following ones.

        Force [N] and moment [N m] at the tool point, along the axes of the base; the last wrench remains constant. The
        plane pushes on the deepest point.
        """
        motion, cell_arm, period = self._motions[arm], self._cell.arms[arm], self._cell.period
        if arm in self._courses:
            return self._scene_wrenches(arm, now)
        if not motion.depths().any():
            return np.zeros((1, 6))
        start = motion.trajectory_time(now)
        depths = np.stack([point.depths() for point in motion.points])[:, round(start / period) :]
        wrenches, deepest = np.zeros((depths.shape[1], 6)), depths.argmax(axis=0)
        for ticks in _split_blocks(np.flatnonzero(depths.any(axis=0))):
            t = np.minimum(start + ticks * period, motion.trajectory.duration)
            offsets = np.stack([point.pose[:3, 3] for point in motion.points])[deepest[ticks]]
            levers = (forward(cell_arm.arm, motion.trajectory(t))[:, :3, :3] @ offsets[..., None])[..., 0]
            up = cell_arm.base[2, :3] * (depths.max(axis=0)[ticks] * self._cell.contact.stiffness)[:, None]
            wrenches[ticks] = np.concatenate([up, np.cross(levers, up)], axis=1)
        return wrenches

    def _scene_wrenches(self, arm: str, now: float) -> Array:
        """Return the wrenches (k, 6) of the scene on a tool at this tick and the following ones, in the base."""
        wrenches = self._courses[arm].wrenches(now, self._cell.period)
        return (wrenches.reshape(-1, 3) @ self._cell.arms[arm].base[:3, :3]).reshape(-1, 6)

    def _depth(self, arm: str, point: _ContactPoint, now: float) -> float:
        """Return the depth of a point in the plane [m]."""
        motion, period, plane = self._motions[arm], self._cell.period, self._cell.contact.height
        t = motion.trajectory_time(now)
        if plane is None or t < point.first_tick * period - _DEPTH_TOLERANCE:
            return 0.0
        tick = round(t / period)
        if abs(t - tick * period) <= _DEPTH_TOLERANCE and tick < len(point.above):
            # A guard is evaluated at every tick, where the height is known.
            return max(0.0, -float(point.above[tick]))
        return max(0.0, plane - float(self._heights(arm, motion.trajectory, point.pose, np.array([t]))[0]))

    def _contact_points(
        self, arm: str, trajectory: Trajectory, tip: Array, pressed: Sequence[Array]
    ) -> tuple[_ContactPoint, ...]:
        """Return the points that may press on the plane: the tip, and those that press on it now."""
        plane = self._cell.contact.height
        if plane is None:
            return ()
        t = self._ticks(trajectory)
        others = [pose for pose in pressed if not np.allclose(pose, tip, rtol=0, atol=_DEPTH_TOLERANCE)]
        points = []
        for pose, is_pressed in ((tip, len(others) < len(pressed)), *((other, True) for other in others)):
            above = self._heights(arm, trajectory, pose, t) - plane
            is_above = above >= -_DEPTH_TOLERANCE
            first_tick = 0 if is_pressed else int(is_above.argmax()) if is_above.any() else len(is_above)
            points.append(_ContactPoint(pose=pose, above=above, first_tick=first_tick))
        return tuple(points)

    def _find_contact_time(self, arm: str, trajectory: Trajectory, tip: Array, tick: int) -> float:
        """Return when a tip that is below the plane at the next tick reaches it."""
        begin, end = tick * self._cell.period, min((tick + 1) * self._cell.period, trajectory.duration)
        plane = self._cell.contact.height
        assert plane is not None  # noqa: S101 - there is no contact without a plane

        def above(t: float) -> float:
            return float(self._heights(arm, trajectory, tip, np.array([t]))[0]) - plane

        if above(begin) <= 0:
            return begin
        from scipy.optimize import brentq  # noqa: PLC0415 - half of what a run would import, and few touch anything

        return float(brentq(above, begin, end, xtol=1e-14))

    def _heights(self, arm: str, trajectory: Trajectory, tip: Array, t: Array) -> Array:
        arm_in_cell = self._cell.arms[arm]
        blocks = (arm_in_cell.base @ forward(arm_in_cell.arm, trajectory(block)) @ tip for block in _split_blocks(t))
        return np.concatenate([poses[:, 2, 3] for poses in blocks])

    def move_fingers(
        self,
        arm: str,
        now: float,
        *,
        closed: bool,
        width: float | None = None,
        frame: str | None = None,  # noqa: ARG002 - in this cell they close on what is there
    ) -> float:
        """Close or open the fingers of an arm; return the time it takes [s].

        The fingers of this simulator take the same time for every width, that of the file. A part that they close on
        moves with the tool from now on, see ``PartPoses``; what they release stays where it is, and does not press on
        the plane any more.
        """
        if self._cell.parts:
            (self._parts.close if closed else self._parts.open)(arm, self._carriers(now), now, width)
        if not closed:
            motion = self._motions[arm]
            is_gripper = [np.allclose(point.pose, np.eye(4), rtol=0, atol=_DEPTH_TOLERANCE) for point in motion.points]
            self._motions[arm] = attrs.evolve(motion, points=tuple(compress(motion.points, is_gripper)))
            if arm in self._courses:
                rest = motion.trajectory.after(motion.trajectory_time(now))
                self._press_on_scene(arm, now, rest, guarded=self._courses[arm].guarded)
        return self._cell.arms[arm].grasp_time if closed else self._cell.arms[arm].open_time

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device.

        Raises:
            DeviceError: the cell file lists devices, and this is none of them.
        """
        self._require_device(device)
        self._signals.write(device, float(on))
        return 0.0

    def set_output(self, device: str, value: float) -> None:
        """Set an analogue device to a number.

        Raises:
            DeviceError: there is no such device, or it can only be on or off.
        """
        self._require_device(device)
        known = (self._cell.devices or {}).get(device)
        if known is None or not known.analogue:
            what = f"device {device} of cell '{self._cell.name}'"
            raise DeviceError(f"{what} is on or off, and cannot be set to a number")
        self._signals.write(device, value)

    def pulse(self, device: str, seconds: float) -> None:
        """Switch a device on for a time [s].

        Raises:
            DeviceError: there is no such device.
        """
        self._require_device(device)
        self._signals.pulse(device, seconds)

    def read_output(self, device: str) -> float:
        """Return what a device is set to.

        Raises:
            DeviceError: there is no such device.
        """
        self._require_device(device)
        return self._signals.output(device)

    def _require_device(self, device: str) -> None:
        devices = self._cell.devices
        if devices is not None and device not in devices:
            near = closest(device, devices)
            hint = f"; did you mean {near}?" if near else ""
            raise DeviceError(f"cell '{self._cell.name}' has no device {device}{hint}")

    def read_input(self, name: str, *, analogue: bool) -> float:
        """Return an input as it is now.

        Raises:
            DeviceError: there is no such input, or it is of the other kind.
        """
        self._require_input(name)
        if self._cell.inputs[name].analogue is not analogue:
            kind, function = ("digital", "INPUT") if analogue else ("analogue", "ANALOG")
            raise DeviceError(f"input {name} of cell '{self._cell.name}' is {kind}; read it by {function}")
        return self._signals.input(name)

    def input_at(self, name: str, time: float) -> float:
        """Return what an input of the cell is at a time that has been come to [s]."""
        return self._signals.input(name, time)

    def set_input(self, name: str, value: float, time: float | None = None) -> None:
        """Set an input by hand, from a time on [s], or from now on.

        Raises:
            DeviceError: there is no such input, a digital one would be neither 0 nor 1, or the number is not finite.
        """
        self._require_input(name)
        if not math.isfinite(value):
            raise DeviceError(f"input {name} of cell '{self._cell.name}': expected a finite number, got {value:g}")
        if not self._cell.inputs[name].analogue and value not in (0.0, 1.0):
            raise DeviceError(f"input {name} of cell '{self._cell.name}' is digital: expected 0 or 1, got {value:g}")
        self._signals.set_input(name, value, time)

    def _require_input(self, name: str) -> None:
        inputs = self._cell.inputs
        if name not in inputs:
            near = closest(name, inputs)
            hint = f"; did you mean {near}?" if near else ""
            raise DeviceError(f"cell '{self._cell.name}' has no input {name}{hint}")

    def note_event(self, event: str) -> None:
        """Take note that the program signals an event now."""
        self._signals.note_event(event)

    def part_poses(self) -> PartPoses:
        """Return where the parts are, and on whose hands. It is not to be changed."""
        return self._parts

    def observations(self) -> Observations:
        """Return where the parts were."""
        return Observations(parts=self._parts.tracks)

    def _carriers(self, now: float) -> dict[str, Array]:
        """Return the pose (4, 4) in the world of each hand, and of the frames that move by themselves."""
        hands = {
            name: arm.base @ forward(arm.arm, self.configuration(name, now)) for name, arm in self._cell.arms.items()
        }
        return hands | self._cell.moving_poses(now)

    def locate(self, frame: str, now: float) -> tuple[Array, float]:
        """Return the next answer of the camera for a frame, in the world, and the time it takes.

        Of a frame that stands for a part it is the grasp pose of this part: on a frame that moves by itself where it
        is when the reading ends, else where it is now. A marker of the scene is where it is. The answers of the cell
        file come one after the other; where it states so, the last one is repeated.

        Raises:
            DeviceError: the cell file has no answer for this frame, or no more.
        """
        sight = self._cell.sights.get(frame)
        if sight is not None and sight.kind == "marker":
            return self._cell.markers[sight.name].pose @ sight.relation, self._cell.vision_time
        if sight is not None:
            moved = self._cell.moving_poses(now + self._cell.vision_time)
            X_WP = self._parts.in_world(sight.name, self._carriers(now) | moved)
            return X_WP @ self._cell.parts[sight.name].grasp, self._cell.vision_time
        answers = self._answers.get(frame)
        if not answers:
            if count := len(self._cell.visions.get(frame, ())):
                raise DeviceError(
                    f"the camera found nothing more for {frame}: cell '{self._cell.name}' has "
                    f"{counted(count, 'answer')} for it; "
                    'with `after_last = "same"` under [camera] the last one stays'
                )
            known = ", ".join(sorted({*self._answers, *self._cell.sights})) or "nothing"
            raise DeviceError(f"the camera found nothing for {frame}; in cell '{self._cell.name}' it finds {known}")
        last = self._cell.camera_repeats and len(answers) == 1
        answer = answers[0] if last else answers.pop(0)
        return self._cell.camera @ answer, self._cell.vision_time

    def active_devices(self) -> frozenset[str]:
        """Return the devices that are on."""
        return self._signals.active()


def _split_blocks(values: np.ndarray) -> list[np.ndarray]:
    """Split values into blocks that are computed together."""
    return np.array_split(values, max(1, -(-len(values) // _BLOCK)))
