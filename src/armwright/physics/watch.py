"""Looks at a world tick by tick and says what has gone wrong in it."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from armwright.arm.model import STANDARD_GRAVITY
from armwright.arrays import Array
from armwright.cell.hardware import Mishap, PeakContact
from armwright.cell.model import Cell
from armwright.physics import mishaps
from armwright.physics.contacts import Contacts
from armwright.physics.gripper import GripperDrive
from armwright.physics.plant import arm_indices
from armwright.physics.servo import Sent
from armwright.physics.world_model import WorldModel, in_hand, part_pose, tool_pose
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import centroid

# How long a held part may be off the pads, and an arm off its track [s].
_LOST, _OFF_TRACK = 0.05, 0.02
# Held parts are looked at so often [s]; a contact counts as over after so long [s].
_LOOK, _PAUSE = 0.01, 0.1
# How long an arm is left alone that has had a mishap [s]: it brakes.
_STOP = 0.2
_NO_CONTACT = PeakContact(0.0, 0.0)


@attrs.define(eq=False)
class Hand:
    """What an arm of a world holds.

    Attributes:
        drive: of its gripper.
        part: in its hand; None without one.
        pose: (4, 4) of the part seen from the tool when it was gripped.
        off: for how many ticks it has not been between the pads.
        closed_tick: at which the gripper will have closed; None where it is not closing.
        expected: the part that it closes on; None where the program does not say.
        slip: how far a part has moved in it at most [m].
        guarded: whether the program looks out for contact during the motion.
        off_track: for how many ticks the arm has not been where it was sent.
        stopping_until: tick up to which the arm is stopped because of a mishap, and others are no news.
        quiet_until: tick up to which contacts are no news.
        deepest: how deep the arm has pressed into the plane since its motion began [m].
        hardest: how hard it has pressed on anything else since then, if the program looks out for contact.
    """

    drive: GripperDrive
    part: str | None = None
    pose: Array | None = None
    off: int = 0
    closed_tick: int | None = None
    expected: str | None = None
    slip: float = 0.0
    guarded: bool = False
    off_track: int = 0
    stopping_until: int = 0
    quiet_until: int = 0
    deepest: float = 0.0
    hardest: PeakContact = _NO_CONTACT

    def copy(self) -> Hand:
        """Return a hand in the same state."""
        return attrs.evolve(self, drive=self.drive.copy())


class Watch:
    """Knows what the hands of a world hold, and finds what has gone wrong at a tick."""

    def __init__(self, cell: Cell, world: WorldModel, contacts: Contacts) -> None:
        """Begin with empty hands."""
        self._cell, self._world, self._contacts = cell, world, contacts
        model = world.model
        self.hands = {name: Hand(GripperDrive(model, name, arm.gripper_or_usual)) for name, arm in cell.arms.items()}
        self._positions = {name: arm_indices(model, name, arm.arm.n).positions for name, arm in cell.arms.items()}
        self._tracking = {name: _tracking_limits(cell, name) for name in cell.arms}
        self._every = max(1, round(_LOOK / cell.period))

    def copy(self, contacts: Contacts) -> Watch:
        """Return a watch in the same state, over the contacts of a copied world."""
        other = object.__new__(Watch)
        other.__dict__.update(self.__dict__)
        other.hands = {name: hand.copy() for name, hand in self.hands.items()}
        other._contacts = contacts
        return other

    # ---- commands ------------------------------------------------------------------------------------------------

    def start_motion(self, arm: str, tick: int, *, guarded: bool) -> None:
        """Take note that a motion of an arm begins."""
        hand = self.hands[arm]
        if not guarded:
            # What it pressed on while it was guarded, it may press on until it is away.
            quiet = tick + (round(_PAUSE / self._cell.period) if hand.guarded else 0)
            hand.quiet_until = max(hand.quiet_until, quiet)
        hand.guarded, hand.deepest, hand.hardest = guarded, 0.0, _NO_CONTACT

    def close(self, arm: str, closed_tick: int, expected: str | None) -> None:
        """Take note that a gripper will have closed at a tick, on a part if the program says on which."""
        hand = self.hands[arm]
        hand.closed_tick, hand.expected = closed_tick, expected

    def open(self, arm: str) -> None:
        """Take note that a gripper opens."""
        hand = self.hands[arm]
        hand.closed_tick = hand.expected = None
        self._let_go(hand)

    def _let_go(self, hand: Hand) -> None:
        hand.part = hand.pose = None
        self._contacts.hold(self._held())

    def _held(self) -> dict[str, str]:
        return {name: hand.part for name, hand in self.hands.items() if hand.part is not None}

    # ---- answers -------------------------------------------------------------------------------------------------

    def known_load(self, arm: str) -> float:
        """Return the mass that the servo of an arm knows in its hand [kg]."""
        part = self.hands[arm].part
        return self._cell.parts[part].mass if part is not None and self._cell.arms[arm].servo.knows_parts else 0.0

    def known_wrench(self, data: Any, arm: str) -> Array:
        """Return the wrench (6,) of the weight of the part that an arm holds, as its controller knows the part.

        Force [N] and moment about the tool point [N m], along the axes of the world.
        """
        mass, part = self.known_load(arm), self.hands[arm].part
        if not mass or part is None:
            return np.zeros(6)
        known = self._cell.parts[part]
        # As the program believes that it holds the part: by its grasp frame.
        lever = tool_pose(data, arm)[:3, :3] @ known.grasp[:3, :3].T @ (centroid(known.shape) - known.grasp[:3, 3])
        weight = mass * self._cell.gravity
        return np.concatenate([weight, np.cross(lever, weight)])

    def peak_contact(self, arm: str) -> PeakContact:
        """Return the hardest contact of an arm since its latest motion began: with the plane, if there is one.

        Without a plane only contacts that the program looks out for count.
        """
        if not self._world.plate:
            return self.hands[arm].hardest
        depth = self.hands[arm].deepest
        return PeakContact(depth, depth * self._cell.contact.stiffness)

    def look(self, data: Any, tick: int, sent: dict[str, Sent]) -> Mishap | None:
        """Return what has gone wrong at a tick that the program must be told of."""
        mishap = self._look(data, tick, sent)
        return mishap if mishap is not None and self._is_news(mishap, tick) else None

    def _is_news(self, mishap: Mishap, tick: int) -> bool:
        """Whether a program must be told of a mishap: not while its arm is stopped because of another."""
        if mishap.arm is None:
            return True
        hand = self.hands[mishap.arm]
        if tick < hand.stopping_until:
            return False
        hand.stopping_until = tick + round(_STOP / self._cell.period)
        return True

    def _look(self, data: Any, tick: int, sent: dict[str, Sent]) -> Mishap | None:
        now, look = tick * self._cell.period, tick % self._every == 0
        if look and _is_unstable(data):
            return mishaps.unstable(now)
        for name, hand in self.hands.items():
            if hand.closed_tick is not None and tick >= hand.closed_tick:
                hand.closed_tick = None
                if (mishap := self._grip(data, now, name, hand)) is not None:
                    return mishap
            elif look and hand.part is not None and (mishap := self._check_grip(data, now, name, hand)) is not None:
                return mishap
            if look and (mishap := self._check_track(data, tick, name, sent[name])) is not None:
                return mishap
        return self._check_contacts(data, tick)

    # ---- hands ---------------------------------------------------------------------------------------------------

    def _grip(self, data: Any, now: float, arm: str, hand: Hand) -> Mishap | None:
        """See what a gripper holds that has closed."""
        part = self._contacts.gripped(data, arm)
        if part is None or (hand.expected is not None and part != hand.expected):
            if hand.expected is None:
                return None
            distance = self._distance(data, arm, hand.expected)
            return mishaps.closed_on_nothing(now, arm, hand.expected, distance)
        hand.part, hand.pose, hand.off = part, in_hand(data, arm, part), 0
        self._contacts.hold(self._held())
        return None

    def _distance(self, data: Any, arm: str, part: str) -> float:
        """Return how far the tool of an arm is from where it grips a part [m]."""
        grasp = part_pose(data, part) @ self._cell.parts[part].grasp
        return float(np.linalg.norm(grasp[:3, 3] - tool_pose(data, arm)[:3, 3]))

    def _check_grip(self, data: Any, now: float, arm: str, hand: Hand) -> Mishap | None:
        """See whether a part is still in the hand."""
        assert hand.part is not None  # noqa: S101 - asked for only then
        assert hand.pose is not None  # noqa: S101
        there = in_hand(data, arm, hand.part)
        slip = float(np.linalg.norm((inverse(hand.pose) @ there)[:3, 3]))
        hand.slip = max(hand.slip, slip)
        off = self._contacts.gripped(data, arm) != hand.part
        hand.off = hand.off + self._every if off else 0
        if hand.off * self._cell.period < _LOST and slip <= self._cell.alarms.slip:
            return None
        part, gripper = hand.part, hand.drive.gripper
        self._let_go(hand)
        pads = 2 if gripper.kind == "fingers" else 1
        holds = pads * gripper.friction * gripper.force / STANDARD_GRAVITY
        return mishaps.lost(now, arm, part, holds, self._world.parts[part].mass)

    # ---- arms ----------------------------------------------------------------------------------------------------

    def _check_track(self, data: Any, tick: int, arm: str, sent: Sent) -> Mishap | None:
        """See whether an arm is where it was sent."""
        hand, limits, period = self.hands[arm], self._tracking[arm], self._cell.period
        error = np.abs(sent.at(tick)[0] - data.qpos[self._positions[arm]])
        before, hand.off_track = hand.off_track, hand.off_track + self._every if (error > limits).any() else 0
        if not before < _OFF_TRACK / period <= hand.off_track:
            return None
        return mishaps.off_track(tick * period, arm, self._cell.arms[arm].arm, error, limits)

    def _check_contacts(self, data: Any, tick: int) -> Mishap | None:
        """See whether an arm, or what it holds, presses on what it should not, or too deep on the plane."""
        now = tick * self._cell.period
        touch = self._contacts.unwanted(data, self._cell.alarms.touch)
        if touch is not None:
            hand, quiet = self.hands[touch.arm], max(1, round(_PAUSE / self._cell.period))
            news = tick > hand.quiet_until and not hand.guarded
            hand.quiet_until = tick + quiet
            if news:
                return mishaps.touched(now, touch)
        if not self._world.plate:
            for name, hand in self.hands.items():
                if hand.guarded:
                    hand.hardest = max(hand.hardest, self._contacts.pressed(data, name), key=lambda it: it.force)
        else:
            depth = self._contacts.plate_depth(data)
            for name, hand in self.hands.items():
                if hand.guarded and depth > hand.deepest:
                    allowed = self._cell.contact.max_depth
                    first, hand.deepest = hand.deepest <= allowed, depth
                    if depth > allowed and first:
                        return mishaps.pressed_too_deep(now, name, depth, allowed)
        return None


def _tracking_limits(cell: Cell, arm: str) -> Array:
    """Return how far each joint may be from where it was sent, (n,) [rad] or [m]."""
    alarms = cell.alarms
    joints = cell.arms[arm].arm.joints
    return np.array([alarms.tracking_angle if joint.revolute else alarms.tracking_length for joint in joints])


def _is_unstable(data: Any) -> bool:
    """Whether positions, speeds or accelerations are no numbers, or have grown beyond all bounds."""
    import mujoco  # noqa: PLC0415 - only cells with physics need it

    kinds = mujoco.mjtWarning
    bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC, kinds.mjWARN_BADCTRL)
    return any(data.warning[int(kind)].number for kind in bad)
