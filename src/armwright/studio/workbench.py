"""What all pages of a studio show: a cell with its arms where they have been moved by hand, and what is wrong there."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, TypeVar

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell, base_name
from armwright.cell.part_poses import PartPoses
from armwright.errors import UnknownNameError
from armwright.kinematics.inverse_kinematics.solution import violations_of
from armwright.physics.collisions import CellCollisions
from armwright.physics.configuration_checks import ConfigurationChecks, NearBodies
from armwright.spatial.poses import from_noap, homogeneous, to_noap
from armwright.spatial.rotations import rotation_from_vector
from armwright.studio.live_arm import LiveArm, Remark, Solution, UnreachableError
from armwright.studio.program_run import ProgramRun
from armwright.studio.reach_map import Plane, ReachMap

_T = TypeVar("_T")

# Full speed of jogging: of angles [rad/s], of lengths [m/s].
TURNING, SLIDING = math.radians(45.0), 0.25
# One step of a jog is no longer [m], [rad].
_LONGEST_STEP = 0.1, math.radians(30.0)
# Bodies nearer than this are reported [m].
_NEAR = 0.02
# Changes that can be taken back at most.
_MOST_UNDONE = 200
# Changes that follow one another within this time are one [s].
_ONE_GESTURE = 0.5


class Workbench:
    """A cell whose arms are moved by hand.

    Attributes:
        cell: the cell.
        arms: its arms, by name.
        ready: whether what moving needs has been compiled.
        map: where an arm can bring its tool; None where no map is shown.
        map_number: counts the maps.
    """

    def __init__(self, cell: Cell) -> None:
        """Take a cell, with its arms at their starts."""
        self.cell = cell
        self.arms = {name: LiveArm(name, arm) for name, arm in cell.arms.items()}
        self.ready = False
        self._parts = PartPoses.standing(cell)
        self._tree = cell.tree()
        # How the program that is shown spells a frame.
        self._spelled: Callable[[str], str] = str
        self._checks: ConfigurationChecks | None = None
        self.map: ReachMap | None = None
        self.map_number = 0
        self._ghost: tuple[str, Array] | None = None
        # What was shown last of a run: parts and openings.
        self._followed: object = None
        # Counts the changes of parts and frames that no motion of an arm makes, and whether arms move frames.
        self._changes = 0
        self._frames_move = (-1, False)
        # What was worked out last, and of what.
        self._known: dict[str, tuple[object, Any]] = {}
        self._undo: list[tuple[str, Array]] = []
        self._gesture = ("", -math.inf)

    def warm_up(self) -> None:
        """Compile what moving needs; takes up to seconds, where nothing is kept from earlier."""
        for arm in self.arms.values():
            arm.warm_up()
        if self.cell.collisions_matter:
            self.nearest()
        self.ready = True

    def arm(self, name: str) -> LiveArm:
        """Return an arm by its name.

        Raises:
            UnknownNameError: there is none.
        """
        if name not in self.arms:
            raise UnknownNameError("arm", name, self.arms)
        return self.arms[name]

    # ---- moving --------------------------------------------------------------------------------------------------

    def set_joint(self, name: str, joint: int, value: float, now: float) -> None:
        """Bring a joint, from 1, to a position [rad] or [m].

        Raises:
            UnreachableError: there is no such joint, or the position is beyond its limits.
        """
        arm = self.arm(name)
        if not 1 <= joint <= len(arm.q):
            raise UnreachableError(f"{name} has joints 1 to {len(arm.q)}, got {joint}")
        q = arm.q.copy()
        q[joint - 1] = value
        beyond = [it for it in violations_of(arm.placed.arm, q.tolist()) if it.joint == joint]
        if beyond:
            raise UnreachableError(str(beyond[0]))
        before = arm.q
        arm.set_joints(q)
        self._changed(arm, before, f"joint {joint}", now)

    def move_tool(self, name: str, pose: tuple[float, ...], now: float, *, leaping: bool) -> None:
        """Bring the tool of an arm to a pose in the world."""
        arm, before = self.arm(name), self.arm(name).q
        arm.move_tool(from_noap(pose), leaping=leaping)
        self._changed(arm, before, "tool", now)

    def jog(  # noqa: PLR0917 - a jog depends on all of this
        self, name: str, frame: str, axis: int, length: float, angle: float, now: float
    ) -> None:
        """Move an arm by a length or by an angle, as the axis is.

        Args:
            name: of the arm.
            frame: ``JOINT``, or whose axes are meant: ``BASE``, ``TOOL``, ``WORLD`` or a frame.
            axis: from 0: a joint; or x, y, z, then the rotations about them, through the tool.
            length: along an axis, or of a sliding joint, with its sign [m].
            angle: about an axis, or of a revolute joint, with its sign [rad].
            now: the time [s].

        Raises:
            UnreachableError: there is no such axis, the step is too long, or the arm cannot go there.
        """
        if abs(length) > _LONGEST_STEP[0] or abs(angle) > _LONGEST_STEP[1]:
            raise UnreachableError("a step is at most 100 mm or 30 deg")
        arm = self.arm(name)
        if frame == "JOINT":
            if not 0 <= axis < len(arm.q):
                raise UnreachableError(f"{name} has {len(arm.q)} joints, got number {axis + 1}")
            revolute = arm.placed.arm.joints[axis].revolute
            value = arm.q[axis] + (angle if revolute else length)
            within = float(np.clip(value, arm.lower[axis], arm.upper[axis]))
            if within != value and np.isclose(arm.q[axis], within):
                raise UnreachableError(f"joint {axis + 1} is at its limit")
            self.set_joint(name, axis + 1, within, now)
            return
        if not 0 <= axis < 6:
            raise UnreachableError(f"axes are numbered from 0 to 5, got {axis}")
        X, along, before = arm.tool, self._axes(arm, frame)[:, axis % 3], arm.q
        if axis < 3:
            X = homogeneous(X[:3, :3], X[:3, 3] + length * along)
        else:
            X = homogeneous(rotation_from_vector(angle * along) @ X[:3, :3], X[:3, 3])
        arm.move_tool(X)
        self._changed(arm, before, f"jog {frame} {axis}", now)

    def _axes(self, arm: LiveArm, frame: str) -> Array:
        """Return the axes (3, 3) of a frame, in its columns."""
        if frame == "WORLD":
            return np.eye(3)
        if frame == "TOOL":
            return arm.tool[:3, :3]
        if frame == "BASE":
            return arm.placed.base[:3, :3]
        poses = self.frame_poses()
        if frame not in poses:
            raise UnknownNameError("frame", frame, ["BASE", "TOOL", "WORLD", *poses])
        return poses[frame][:3, :3]

    def go_to(self, name: str, goal: str, now: float) -> None:
        """Bring the tool of an arm to a frame, or the arm to a joint target."""
        arm, q, before = self.arm(name), self._configuration_at(name, goal), self.arm(name).q
        arm.set_joints(q)
        self._changed(arm, before, f"go to {goal}", now)

    def _configuration_at(self, name: str, goal: str) -> Array:
        """Return the configuration (n,) in which an arm is at a frame or a joint target.

        Raises:
            UnknownNameError: there is neither.
            UnreachableError: the arm cannot be there.
        """
        poses, targets = self.frame_poses(), self.cell.joint_targets
        if goal in poses:
            return self.arm(name).configuration_for(poses[goal])
        if goal not in targets:
            raise UnknownNameError("frame or joint target", goal, [*poses, *targets])
        if targets[goal].arm != name:
            raise UnreachableError(f"{goal} is a configuration of {targets[goal].arm}")
        return targets[goal].q

    def take_solution(self, name: str, number: int, now: float) -> None:
        """Take another configuration that brings the tool to where it is, by its number, from 0."""
        arm = self.arm(name)
        solutions = arm.solutions()
        if not 0 <= number < len(solutions):
            raise UnreachableError(f"there are solutions 0 to {len(solutions) - 1}, got {number}")
        if solutions[number].fault:
            raise UnreachableError(solutions[number].fault)
        before = arm.q
        arm.set_joints(solutions[number].q)
        self._changed(arm, before, "solution", now)

    def grip(self, name: str, *, open_it: bool, now: float) -> None:
        """Open or close the gripper of an arm; it takes the part that is between its fingers."""
        self.arm(name)
        (self._parts.open if open_it else self._parts.close)(name, self._tools(), now)
        self._checks = None
        self._changes += 1

    def _changed(self, arm: LiveArm, before: Array, gesture: str, now: float) -> None:
        """Keep where an arm was, to return to it, unless it is still moved by the same gesture, or has not moved."""
        what, latest = self._gesture
        if np.array_equal(arm.q, before):
            return
        if what != f"{arm.name} {gesture}" or now - latest > _ONE_GESTURE:
            self._undo = [*self._undo, (arm.name, before)][-_MOST_UNDONE:]
        self._gesture = f"{arm.name} {gesture}", now

    def undo(self) -> None:
        """Bring the arm that was moved last to where it was before."""
        if not self._undo:
            raise UnreachableError("there is nothing to take back")
        name, q = self._undo.pop()
        self.arms[name].q, self._gesture = q, ("", -math.inf)

    def follow(self, run: ProgramRun) -> None:
        """Show what a run shows: its arms, parts and frames."""
        for name, arm in self.arms.items():
            measured = run.measured(name)
            arm.q = run.motion(name)[0] if measured is None else np.array(measured.q)
        tree, parts = run.tree(), run.parts()
        if tree is not self._tree:
            self._tree, self._spelled = tree, run.spelled
            self._changes += 1
        widths = {name: arm.gripper_or_usual.opening for name, arm in self.cell.arms.items()}
        openings = {name: run.happened.openings.get(name, 1.0) * width for name, width in widths.items()}
        key = tuple((carrier, X.tobytes()) for carrier, X in parts.values()), tuple(openings.values())
        if key != self._followed:
            self._followed, self._checks = key, None
            self._changes += 1
            self._parts = PartPoses.arranged(self.cell, parts, openings)

    def reset(self) -> None:
        """Put arms, parts and frames to where they are at the start of the cell."""
        for arm in self.arms.values():
            arm.q = np.array(arm.placed.start)
        self._parts, self._tree, self._spelled = PartPoses.standing(self.cell), self.cell.tree(), str
        self._checks = self._followed = None
        self._changes += 1

    def configurations(self) -> dict[str, Array]:
        """Return the joint positions (n,) of the arms."""
        return {name: arm.q for name, arm in self.arms.items()}

    def part_poses(self) -> dict[str, Array]:
        """Return the poses (4, 4) of the parts in the world."""
        tools = self._tools()
        return {name: self._parts.in_world(name, tools) for name in self.cell.parts}

    def _tools(self) -> dict[str, Array]:
        return {name: arm.tool for name, arm in self.arms.items()}

    def with_tools(self, tree: FrameTree) -> FrameTree:
        """Return a frame tree with the tools of the arms where they are shown."""
        for name, X in self._tools().items():
            tree = tree.set_pose(name, X)
        return tree

    def cell_as_shown(self) -> Cell:
        """Return the cell with arms and parts where they are shown."""
        poses = self.part_poses()
        arms = {name: attrs.evolve(it, start=self.arms[name].q) for name, it in self.cell.arms.items()}
        parts = {name: attrs.evolve(it, pose=poses[name]) for name, it in self.cell.parts.items()}
        return attrs.evolve(self.cell, arms=arms, parts=parts)

    def take_frames(self, cell: Cell) -> None:
        """Take the frames and joint targets of a cell that differs in nothing else."""
        self.cell, self._tree, self._spelled = cell, cell.tree(), str
        self._changes += 1

    # ---- maps and previews ---------------------------------------------------------------------------------------

    def show_map(self, name: str, plane: Plane | None) -> None:
        """Begin a map of a plane through the tool of an arm; None for no map."""
        self.map = None if plane is None else ReachMap(self.arm(name), plane)
        self.map_number += 1

    def map_on(self) -> bool:
        """Work out some more of the map; return whether there was more."""
        if self.map is None or self.map.done:
            return False
        self.map.step()
        return True

    def preview(self, name: str, goal: str) -> None:
        """Show where an arm would be at a frame or a joint target; without a name, show that no more."""
        self._ghost = None
        if goal:
            self._ghost = self.arm(name).name, self._configuration_at(name, goal)

    # ---- what is shown -------------------------------------------------------------------------------------------

    def frame_poses(self) -> dict[str, Array]:
        """Return the poses (4, 4) of the frames of the cell in the world, by name."""
        tree, hidden = self.with_tools(self._tree), {"WORLD", *self.arms, *map(base_name, self.arms)}
        return {self._spelled(name): tree.world(name) for name in tree if name not in hidden and tree.has_value(name)}

    @cached_property
    def _collisions(self) -> CellCollisions:
        return CellCollisions(self.cell)

    def nearest(self) -> NearBodies | None:
        """Return the two bodies that are nearest to one another; None where nothing is near, or nothing can meet."""
        if self._checks is None:
            self._checks = self._collisions.at_configurations(self._parts)
        return self._checks.nearest(self.configurations(), _NEAR)

    def state(self) -> dict[str, Any]:
        """Return what a page shows that changes with the arms, as plain data."""
        stood = self.ready, self._changes
        moved = {name: arm.q.tobytes() for name, arm in self.arms.items()}
        return {
            "ready": self.ready,
            "arms": {
                name: self._once(f"arm {name}", (moved[name], stood), partial(self._arm_state, arm))
                for name, arm in self.arms.items()
            },
            "near": self._once("near", (moved, stood), self._near_state),
            "ghost": None if self._ghost is None else {"arm": self._ghost[0], "q": _rounded(self._ghost[1])},
            "undo": len(self._undo),
        }

    @property
    def around_key(self) -> object:
        """What is around the arms is the same where this is."""
        if self._frames_move[0] != self._changes:
            moving = any(not self.arms.keys().isdisjoint(self._tree.ancestors(name)) for name in self._tree)
            self._frames_move = self._changes, moving
        arms = tuple(arm.q.tobytes() for arm in self.arms.values()) if self._frames_move[1] else ()
        return self._changes, arms

    def around_state(self) -> dict[str, Any]:
        """Return what a page shows of what is around the arms, as plain data: parts, frames and joint targets."""
        return {
            "parts": {name: self._part_state(name) for name in self.cell.parts},
            "frames": {name: _rounded(to_noap(X)) for name, X in self.frame_poses().items()},
            "targets": {name: {"arm": it.arm, "q": _rounded(it.q)} for name, it in self.cell.joint_targets.items()},
        }

    def _once(self, what: str, key: object, make: Callable[[], _T]) -> _T:
        """Return what is made of a key, or what was made of it last: for another page, or of what stands still."""
        known = self._known.get(what)
        if known is None or known[0] != key:
            known = self._known[what] = key, make()
        made: _T = known[1]
        return made

    def _arm_state(self, arm: LiveArm) -> dict[str, Any]:
        opening = arm.placed.gripper_or_usual.opening
        state: dict[str, Any] = {
            "q": _rounded(arm.q),
            "grip": round(self._parts.opening(arm.name) / opening, 4),
            "holds": list(self._parts.held_by(arm.name)),
        }
        if self.ready:
            state["tool"] = _rounded(to_noap(arm.tool))
            state["solutions"] = _solution_states(arm.solutions())
            state["warnings"] = [_remark_state(it) for it in arm.remarks()]
        return state

    def _part_state(self, name: str) -> dict[str, Any]:
        return {"arm": self._parts.carrier(name), "pose": _rounded(to_noap(self._parts.pose(name)))}

    def _near_state(self) -> dict[str, Any] | None:
        near = self.nearest() if self.ready and self.cell.collisions_matter else None
        return None if near is None else {"distance": round(near.distance, 6), "bodies": list(near.names)}


def _solution_states(solutions: list[Solution]) -> list[dict[str, Any]]:
    rows = _rounded(np.array([it.q for it in solutions]))
    return [
        {"label": it.label, "fault": it.fault, "here": it.here, "q": q} for it, q in zip(solutions, rows, strict=True)
    ]


def _remark_state(it: Remark) -> dict[str, Any]:
    return {"kind": it.kind, "level": it.level, "text": it.text, "joints": list(it.joints)}


def _rounded(array: Array) -> list[Any]:
    return (np.round(array, 7) + 0.0).tolist()  # type: ignore[no-any-return] # adding 0 turns -0 into 0
