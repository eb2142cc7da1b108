"""A cell with physics: the hardware of a program that can drop parts, miss them, and run into things.

The arms are driven by servos, their fingers hold by friction, and parts fall. Beside the world there is a kinematic
simulator, which follows the same commands: it knows where arms have been sent and where the program must believe that
parts are.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import DeviceError, Mishap, PeakContact
from armwright.cell.model import Cell
from armwright.cell.observations import MeasuredStream, Observations, Picture
from armwright.cell.part_poses import PartPoses
from armwright.cell.scene import Part
from armwright.cell.simulator import Simulator
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.trajectory import Trajectory, hold
from armwright.physics import mishaps
from armwright.physics.contacts import Contacts
from armwright.physics.draws import drawn_frames, drawn_parts, placed_fixtures
from armwright.physics.measured import Log
from armwright.physics.pictures import Photographer, png
from armwright.physics.plant import arm_indices
from armwright.physics.seeing import target_of
from armwright.physics.servo import ArmServo, Measured, Sent, TorqueLaw
from armwright.physics.start import buried_bases, check_arguments
from armwright.physics.vision import camera_in_world, look
from armwright.physics.watch import Watch
from armwright.physics.world_model import WorldModel, part_pose, part_velocity, world_model
from armwright.physics.wrist_sensor import WristSensor
from armwright.spatial.poses import inverse, to_noap

# A time so little before a tick is on it.
_TICK_TOLERANCE = 1e-6
# Of very many pictures the last ones are kept, and of large ones those of so many bytes together.
_MAX_PICTURES, _MAX_PICTURE_BYTES = 500, 200_000_000
# So are they of very many mishaps.
_MAX_MISHAPS = 1000
# Ticks between poses of the tool that are compared.
_TIP_TICKS = 10


class PhysicsCell:
    """A cell as a world with physics. The same commands from the same seed give the same bits."""

    def __init__(
        self,
        cell: Cell,
        *,
        seed: int = 0,
        laws: Mapping[str, TorqueLaw] | None = None,
        parts: Mapping[str, Part] | None = None,
        frames: Mapping[str, Array] | None = None,
    ) -> None:
        """Set up the initial state.

        Args:
            cell: the cell.
            seed: what is random is drawn from it: where parts stand, and the noise of sensors and cameras.
            laws: controllers of arms by name, instead of the servos of the cell.
            parts: as they are in this world; drawn from their spreads where they are left out.
            frames: (4, 4) where the frames of the cell are in this world; drawn likewise. Programs know nothing of it.

        Raises:
            KindError: an argument is of another kind.
            UnsupportedArmError: masses of an arm are unknown.
            InvalidValueError: things stand inside each other at the start, a camera looks for a part without a marker,
                a law is for no arm of the cell, or the parts are not those of the cell.
            MissingExtraError: a camera takes pictures, and OpenCV is missing.
        """
        check_arguments(cell, seed, laws, parts)
        for sight in cell.sights.values():
            if sight.camera is not None:
                target_of(cell, sight)
        self._cell, self._believed = cell, Simulator(cell, follows_plans=False)
        self._zone_arms = {source.zone.arm for source in cell.inputs.values() if source.zone is not None}
        self._seed, self._rng = seed, np.random.default_rng(seed)
        parts = drawn_parts(cell, self._rng) if parts is None else parts
        self._frames = drawn_frames(cell, self._rng) if frames is None else frames
        self._world = world_model(attrs.evolve(cell, fixtures=placed_fixtures(cell, self._frames)), parts)
        self._contacts = Contacts(self._world)
        self._data = _initial_data(self._world)
        model, period = self._world.model, cell.period
        self._watch = Watch(cell, self._world, self._contacts)
        self._servos, self._sent = {}, {}
        for name, arm in cell.arms.items():
            self._servos[name] = ArmServo(
                arm.arm,
                arm.plant or arm.arm,
                arm_indices(model, name, arm.arm.n),
                arm.servo,
                arm.sensors,
                period,
                (laws or {}).get(name),
            )
            self._servos[name].start(self._data)
            self._watch.hands[name].drive.start(self._data)
            self._sent[name] = Sent(hold(arm.start, 0.0), 0, period, self._servos[name].friction)
        self._tick = 0
        fingers = {name: hand.drive.positions for name, hand in self._watch.hands.items()}
        self._log = Log(cell, self._world, self._servos, fingers)
        for name, sent in self._sent.items():
            self._log.send(name, 0, sent)
        self._pictures: tuple[Picture, ...] = ()
        self._mishaps: tuple[Mishap, ...] = ()
        # Made for the first picture, and shared by copies.
        self._photographers: list[Photographer] = []
        self._wrists = {name: WristSensor(arm.force_sensor) for name, arm in cell.arms.items()}
        self._settle()

    def _settle(self) -> None:
        """Refuse a world in which things stand inside each other."""
        import mujoco  # noqa: PLC0415 - only cells with physics need it

        mujoco.mj_forward(self._world.model, self._data)
        overlaps = self._contacts.overlaps(self._data)
        overlaps += buried_bases(self._world.cell)
        if overlaps:
            worst = max(overlaps, key=lambda overlap: overlap.depth)
            raise InvalidValueError(
                f"cell '{self._cell.name}': {worst.one} and {worst.other} stand inside each other at the start, "
                f"{worst.depth * 1e3:.3g} mm deep"
            )

    def copy(self) -> PhysicsCell:
        """Return a world in the same state; later commands to one do not change the other."""
        import mujoco  # noqa: PLC0415 - only cells with physics need it

        other = object.__new__(PhysicsCell)
        other.__dict__.update(self.__dict__)
        other._believed, other._data = self._believed.copy(), mujoco.MjData(self._world.model)
        mujoco.mj_copyData(other._data, self._world.model, self._data)
        other._servos = {name: servo.copy() for name, servo in self._servos.items()}
        other._sent = dict(self._sent)
        other._wrists = {name: wrist.copy() for name, wrist in self._wrists.items()}
        other._log, other._rng = self._log.copy(), np.random.default_rng()
        other._rng.bit_generator.state = self._rng.bit_generator.state
        other._contacts = copy.copy(self._contacts)
        other._watch = self._watch.copy(other._contacts)
        return other

    # ---- time ----------------------------------------------------------------------------------------------------

    def advance(self, now: float) -> Mishap | None:
        """Let time go by, until now or until something goes wrong."""
        end = math.floor(now / self._cell.period + _TICK_TOLERANCE)
        while self._tick < end:
            mishap = self._step() or self._watch.look(self._data, self._tick, self._sent)
            if mishap is not None:
                self._mishaps = (*self._mishaps, mishap)[-_MAX_MISHAPS:]
                self._believed.advance(self.now)
                return mishap
        self._believed.advance(now)
        return None

    @property
    def now(self) -> float:
        """The time up to which the world has gone [s]."""
        return self._tick * self._cell.period

    def _step(self) -> Mishap | None:
        """Let one period of the servo go by; return that this cannot be, if numbers without meaning come to a servo."""
        data, now = self._data, self.now
        for name, servo in self._servos.items():
            hand = self._watch.hands[name]
            servo.load, servo.leaning = self._watch.known_load(name), hand.guarded
            try:
                q, qd, tau = servo.drive(data, now, self._sent[name].at(self._tick))
            except InvalidValueError:
                if np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all():
                    raise
                # Time goes by, but nothing happens any more.
                self._tick += 1
                return mishaps.unstable(self.now)
            hand.drive.step(data)
            if not servo.reads_exactly:
                noise = self._cell.arms[name].sensors.effort_noise
                if noise:
                    tau = tau + noise * servo.finite_effort * self._rng.normal(size=len(tau))
                self._log.add_reading(name, self._tick, q, qd, tau)
        self._log.add(self._tick, data)
        self._world.step(data)
        # A step leaves the poses of its beginning.
        self._log.add_parts(self._tick, data)
        self._tick += 1
        for name in self._zone_arms:
            arm = self._cell.arms[name]
            q = data.qpos[self._servos[name].indices.positions]
            tool = arm.base @ forward(arm.plant or arm.arm, q)
            self._believed.note_tool(name, tool[None, :3, 3], self.now)
        return None

    # ---- arms ----------------------------------------------------------------------------------------------------

    def configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) of an arm: as its sensors read them, as they are sent at a time to come."""
        if now > self.now + self._cell.period * _TICK_TOLERANCE:
            return self.sent_configuration(arm, now)
        return self._servos[arm].configuration(self._data)

    def sent_configuration(self, arm: str, now: float) -> Array:
        """Return the joint positions (n,) that an arm is sent to, now or at a time to come."""
        return self._believed.sent_configuration(arm, now)

    def start_motion(self, arm: str, trajectory: Trajectory, now: float, tip: Array, *, guarded: bool = False) -> None:
        """Let an arm follow a trajectory that begins where it has been sent."""
        self._believed.start_motion(arm, trajectory, now, tip, guarded=guarded)
        friction = self._servos[arm].friction
        self._sent[arm] = Sent(trajectory, round(now / self._cell.period), self._cell.period, friction)
        self._log.send(arm, self._tick, self._sent[arm])
        self._watch.start_motion(arm, self._tick, guarded=guarded)

    def contact_time(self, arm: str) -> None:
        """Return None: when a motion comes into contact is not known beforehand."""

    def excess_depth_time(self, arm: str) -> None:
        """Return None: how deep a motion presses is not known beforehand."""

    def peak_contact(self, arm: str, now: float) -> PeakContact:  # noqa: ARG002 - it is now
        """Return the deepest contact of an arm with the plane since its latest motion began."""
        return self._watch.peak_contact(arm)

    def contact_wrench(self, arm: str, now: float) -> Array:  # noqa: ARG002 - it is now
        """Return the wrench (6,) on the tool of an arm and what it holds, as its sensor reads it [N] and [N m]."""
        return self._wrists[arm].read(self._tick, self.now, lambda: self._true_wrench(arm), self._rng)

    def zero_force(self, arm: str, now: float) -> Array:  # noqa: ARG002 - it is now
        """Let what the sensor of an arm reads count as zero from now on; return it (6,)."""
        return self._wrists[arm].zero(self._tick, self.now, lambda: self._true_wrench(arm), self._rng)

    def _true_wrench(self, arm: str) -> Array:
        """Return the wrench (6,) on a tool and what it holds, without the weights that the controller knows."""
        return self._contacts.tool_wrench(self._data, arm) - self._watch.known_wrench(self._data, arm)

    def tool_wrenches(self, arm: str, now: float) -> Array:  # noqa: ARG002 - nobody knows beforehand
        """Return no wrenches (1, 6): planned efforts are those of free motion."""
        return np.zeros((1, 6))

    # ---- gripper, devices, camera --------------------------------------------------------------------------------

    def move_fingers(
        self, arm: str, now: float, *, closed: bool, width: float | None = None, frame: str | None = None
    ) -> float:
        """Close or open the gripper of an arm; return the time it takes."""
        seconds = self._believed.move_fingers(arm, now, closed=closed, width=width, frame=frame)
        ticks = max(1, math.ceil(seconds / self._cell.period - _TICK_TOLERANCE))
        # It arrives a little earlier than it says.
        drive = self._watch.hands[arm].drive
        drive.send(self._data, closed=closed, width=width, ticks=max(1, round(0.7 * ticks)))
        if closed:
            self._watch.close(arm, self._tick + ticks, self._part_of(frame))
        else:
            self._watch.open(arm)
        return seconds

    def _part_of(self, frame: str | None) -> str | None:
        """Return the part that a frame of the program stands for."""
        if frame is None:
            return None
        return self._cell.seen_parts.get(frame, frame if frame in self._cell.parts else None)

    def operate(self, device: str, *, on: bool) -> float:
        """Switch a device; return the time it takes."""
        return self._believed.operate(device, on=on)

    def set_output(self, device: str, value: float) -> None:
        """Set an analogue device to a number."""
        self._believed.set_output(device, value)

    def pulse(self, device: str, seconds: float) -> None:
        """Switch a device on for a time [s]."""
        self._believed.pulse(device, seconds)

    def read_output(self, device: str) -> float:
        """Return what a device is set to."""
        return self._believed.read_output(device)

    def read_input(self, name: str, *, analogue: bool) -> float:
        """Return an input as it is now."""
        return self._believed.read_input(name, analogue=analogue)

    def input_at(self, name: str, time: float) -> float:
        """Return what an input of the cell is at a time that has been come to [s]."""
        return self._believed.input_at(name, time)

    def set_input(self, name: str, value: float, time: float | None = None) -> None:
        """Set an input by hand, from a time on [s], or from now on."""
        self._believed.set_input(name, value, time)

    def note_event(self, event: str) -> None:
        """Take note that the program signals an event now."""
        self._believed.note_event(event)

    def active_devices(self) -> frozenset[str]:
        """Return the devices that are on."""
        return self._believed.active_devices()

    def part_poses(self) -> PartPoses:
        """Return where the parts are believed to be."""
        return self._believed.part_poses()

    def locate(self, frame: str, now: float) -> tuple[Array, float]:
        """Let the camera locate the object of a frame; return its pose in the world and the time it takes."""
        sight = self._cell.sights.get(frame)
        if sight is None:
            return self._believed.locate(frame, now)
        if sight.camera is not None:
            X_WF = self._seen(frame, sight.camera)
        elif sight.kind == "part":
            X_WF = part_pose(self._data, sight.name) @ sight.relation
        else:
            X_WF = self._cell.markers[sight.name].pose @ sight.relation
        if sight.kind == "part":
            self._believed.part_poses().see(sight.name, X_WF @ inverse(sight.relation), now)
        return X_WF, self._cell.vision_time

    def _seen(self, frame: str, camera: str) -> Array:
        """Take a picture and return the pose of a frame that is found in it.

        Raises:
            DeviceError: it is not found.
        """
        import mujoco  # noqa: PLC0415 - only cells with physics need it

        # A step leaves the poses of its beginning: those of its end belong to what the arms read.
        mujoco.mj_kinematics(self._world.model, self._data)
        mujoco.mj_camlight(self._world.model, self._data)
        if not self._photographers:
            self._photographers.append(Photographer(self._world.model, self._cell.cameras))
        carrier = self._cell.cameras[camera].on
        q = None if carrier is None else self.configuration(carrier, self.now)
        X_WC = camera_in_world(self._cell, self._cell.cameras[camera], q)
        seed = (self._seed, self._tick)
        seen = look(self._photographers[0], self._data, self._cell, frame, X_WC, seed)
        text = seen.message if seen.pose is None else f"{frame} at {_position_text(seen.pose)}"
        taken = Picture(
            time=self.now, camera=camera, frame=frame, png=png(seen.picture), found=seen.pose is not None, text=text
        )
        self._pictures = _latest((*self._pictures, taken))
        if seen.pose is None:
            raise DeviceError(seen.message)
        return seen.pose

    # ---- results -------------------------------------------------------------------------------------------------

    def measured(self, arm: str, time: float) -> Measured:
        """Return what the servo of an arm measured and did at a time [s] that has gone by; at rest before the first."""
        if not self._tick:
            q = self.configuration(arm, 0.0)
            rest = np.zeros_like(q)
            return Measured(q, rest, rest, q)
        return self._log.at(arm, round(time / self._cell.period))

    def part_pose(self, part: str, time: float) -> Array:
        """Return the pose (4, 4) of a part in the world at a time [s] that has gone by."""
        return self._log.part_pose(part, time)

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The latest pictures that cameras have taken."""
        return self._pictures

    def true_pose(self, part: str) -> Array:
        """Return the pose (4, 4) of a part in the world, as it is now."""
        return part_pose(self._data, part)

    def true_frame(self, frame: str) -> Array:
        """Return the pose (4, 4) of a frame of the cell in the world, which is not where programs believe it."""
        return self._frames[frame]

    def speed(self, part: str) -> tuple[float, float]:
        """Return how fast a part moves [m/s] and turns [rad/s]."""
        velocity = part_velocity(self._data, part)
        return float(np.linalg.norm(velocity[:3])), float(np.linalg.norm(velocity[3:]))

    def touching_arms(self, part: str) -> tuple[str, ...]:
        """Return the arms whose links or grippers touch a part."""
        return self._contacts.touching_arms(self._data, part)

    @property
    def mishaps(self) -> tuple[Mishap, ...]:
        """What has gone wrong so far, also where the program has dealt with it."""
        return self._mishaps

    def observations(self) -> Observations:
        """Return what the servos measured, where the parts were, and the largest errors."""
        import mujoco  # noqa: PLC0415 - only cells with physics need it

        measured = self._log.streams()
        facts = {
            "engine": "MuJoCo",
            "version": mujoco.__version__,
            "step": self._cell.period / self._world.substeps,
            "seed": self._seed,
            "tracking": {
                stream.arm: np.abs(stream.q - stream.sent).max(axis=0, initial=0.0).tolist() for stream in measured
            },
            "tip": {stream.arm: _tip_error(self._cell, stream) for stream in measured},
            "slip": {name: hand.slip for name, hand in self._watch.hands.items()},
            "frames": {name: to_noap(self.true_frame(name)).tolist() for name in self._cell.spreads},
            "parts": {name: to_noap(self.true_pose(name)).tolist() for name in self._world.parts},
        }
        return Observations(parts=self._log.tracks(), measured=measured, pictures=self._pictures, facts=facts)


def _latest(pictures: tuple[Picture, ...]) -> tuple[Picture, ...]:
    """Return the last pictures, as many as are kept."""
    pictures = pictures[-_MAX_PICTURES:]
    while sum(len(picture.png) for picture in pictures) > _MAX_PICTURE_BYTES:
        pictures = pictures[1:]
    return pictures


def _initial_data(world: WorldModel) -> Any:
    import mujoco  # noqa: PLC0415 - only cells with physics need it

    # What MuJoCo warns of is told as a mishap; by itself it would print it, and write a file where the user is.
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(lambda _: None)
    # What has become meaningless is told, not forgotten.
    world.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    data = mujoco.MjData(world.model)
    for name, arm in world.cell.arms.items():
        data.qpos[arm_indices(world.model, name, arm.arm.n).positions] = arm.start
    return data


def _tip_error(cell: Cell, stream: MeasuredStream) -> float:
    """Return how far the tool of an arm was from where it was sent at most, at every tenth tick [m].

    The tool is where the arm of the world has it, whatever the sensors read; where it was sent is what the controller
    believes.
    """
    arm = cell.arms[stream.arm]
    sent = forward(arm.arm, stream.sent[::_TIP_TICKS])[:, :3, 3]
    there = forward(arm.plant or arm.arm, stream.actual[::_TIP_TICKS])[:, :3, 3]
    return float(np.linalg.norm(sent - there, axis=1).max(initial=0.0))


def _position_text(X: Array) -> str:
    """Return the text of the position of a pose (4, 4) in the world."""
    return "({:.1f}, {:.1f}, {:.1f}) mm".format(*(X[:3, 3] * 1e3))
