"""The state of a running program: clock, frames, values, processes, and what it has left so far."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.frames import WORLD, FrameTree
from armwright.cell.hardware import Hardware, SimulatedHardware
from armwright.cell.loads import loaded_arm, loads_over_time
from armwright.cell.model import Cell, base_name
from armwright.errors import ArmwrightError
from armwright.kinematics.forward_kinematics import forward
from armwright.program.bytecode.instructions import Code, Instruction, JumpTarget, Operand, Text
from armwright.program.language.diagnostic import Diagnostic, Label
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.vm.error_kinds import error_kind
from armwright.program.vm.process import ElementReference, PendingEffect, Process, StartTime, Value
from armwright.program.vm.recording import Effect, EffectKind, Recording, sample_stream, sort_effects, thin_trees
from armwright.program.vm.state import MachineState
from armwright.program.vm.value_text import value_text
from armwright.spatial.poses import from_noap, to_noap

if TYPE_CHECKING:
    from armwright.physics.collisions import CellCollisions

# A time this part of a period behind a tick is on it.
_TICK_TOLERANCE = 1e-9
# The longest PAUSE, pulse or WAIT; more is a slip of units [s].
MAX_PAUSE = 1e6
# Frame trees that are kept; a page shows fewer.
_MAX_TREES = 2000


class RunError(ArmwrightError, RuntimeError):
    """A program could not go on.

    Attributes:
        diagnostic: what happened, where.
        tree: the frame tree at that moment.
        time: of the cell's clock [s].
        recording: returns all that happened up to it; None before the arms are at rest.
        kind: of the error, which a RECOVER may name: one of the language, or the program's own.
    """

    def __init__(
        self, diagnostic: Diagnostic, tree: FrameTree, time: float, recording: Callable[[], Recording] | None = None
    ) -> None:
        """Keep the circumstances; the text is the diagnostic's message."""
        self.diagnostic, self.tree, self.time, self.recording = diagnostic, tree, time, recording
        self.kind = error_kind(diagnostic.code)
        super().__init__(diagnostic.message)


@attrs.frozen(kw_only=True)
class Limits:
    """When a program is taken to run for ever.

    Attributes:
        steps: instructions without any time going by; a MOVE counts as many of them, because it is planned.
        depth: procedures inside procedures.
        processes: processes side by side, and COBEGINs inside COBEGINs a tenth of that.
        time: on the clock of the cell [s].
    """

    steps: int = 1_000_000
    depth: int = 1000
    processes: int = 1000
    time: float = 3600.0


class Machine:
    """A program that runs in a cell."""

    def __init__(self, code: Code, cell: Cell, hardware: Hardware, limits: Limits | None = None) -> None:
        """Stand in front of the first instruction."""
        self.code, self.cell, self.hardware, self.limits = code, cell, hardware, limits or Limits()
        self.state = MachineState.initial(code, cell)
        self.constants = constant_values(code.constants)
        self._collisions: CellCollisions | None = None

    @property
    def collisions(self) -> CellCollisions | None:
        """What arms may run into; None where there is nothing of the kind in the cell."""
        if self._collisions is None and self.cell.collisions_matter:
            from armwright.physics.collisions import CellCollisions  # noqa: PLC0415 - of cells with bodies

            self._collisions = CellCollisions(self.cell)
        return self._collisions

    def copy(self) -> Machine:
        """Return a machine in the same state; what one of them does changes nothing in the other.

        Raises:
            TypeError: the hardware is a real cell, which cannot be copied.
        """
        if not isinstance(self.hardware, SimulatedHardware):
            raise TypeError(f"only a simulated cell can be copied, not a {type(self.hardware).__name__}")
        copied = copy.copy(self)
        copied.hardware, copied.state = self.hardware.copy(), self.state.copy()
        return copied

    def with_code(self, code: Code) -> Machine:
        """Return a machine that runs other code on the state and the hardware of this one."""
        other = copy.copy(self)
        other.code, other.constants = code, constant_values(code.constants)
        return other

    @property
    def now(self) -> float:
        """The time [s]."""
        return self.state.ticks * self.cell.period

    def recording(self) -> Recording:
        """Return all that happened so far."""
        cell, state = self.cell, self.state
        # What goes wrong while the arms come to rest is of no program any more.
        while self.hardware.advance(self.now) is not None:
            pass
        tracks = self.hardware.part_poses().tracks if cell.parts else {}
        streams = tuple(
            sample_stream(
                name,
                arm,
                state.segments[name],
                state.tool_wrenches[name],
                end_tick=state.ticks,
                period=cell.period,
                loads=loads_over_time(cell, name, tracks),
            )
            for name, arm in cell.arms.items()
        )
        return Recording(
            code=self.code,
            cell=cell,
            duration=self.now,
            effects=sort_effects(state.effects),
            stages=tuple(state.stages),
            streams=streams,
            trees=tuple(state.trees),
            configurations={name: self.hardware.configuration(name, self.now) for name in cell.arms},
            observations=self.hardware.observations(),
            checked=None if self._collisions is None else self._collisions.checked,
        )

    def timer(self, name: str) -> float:
        """Return the seconds of a timer; one that was never started has none."""
        seconds, since = self.state.timers.get(name, (0.0, None))
        return seconds if since is None else seconds + (self.state.ticks - since) * self.cell.period

    # ---- names and values ------------------------------------------------------------------------------------------

    def resolve_name(self, process: Process, operand: Operand) -> str:
        """Return what an operand names: where a variable or element is kept, an arm, a device."""
        name = self.variable_name(process, operand)
        assert name is not None  # noqa: S101 - the translator names what is written
        return name

    def variable_name(self, process: Process, operand: Operand) -> str | None:
        """Return what an operand names, as ``resolve_name`` does; None for the value of an expression."""
        if not isinstance(operand, str):
            return None
        if operand.startswith("%"):
            value = process.activation.temporaries[operand]
            return value.name if isinstance(value, ElementReference) else None
        return process.activation.bindings.get(operand, operand)

    def type_of(self, name: str) -> VariableType:
        """Return what a kept name holds; of an element, what the element holds."""
        base, bracket, _ = name.partition("[")
        if is_arm(name) or base not in self.state.types:
            return VariableType(VariableKind.FRAME)
        return VariableType(self.state.types[base].kind) if bracket else self.state.types[base]

    def read(self, process: Process, operand: Operand, span: Span) -> Value:
        """Return the value of an operand.

        Raises:
            RunError: a variable has no value yet.
        """
        if not isinstance(operand, str):
            if isinstance(operand, Text):
                return operand.value
            assert isinstance(operand, float | int)  # noqa: S101 - nothing else has a value
            return float(operand)
        name = self.variable_name(process, operand)
        return process.activation.temporaries[operand] if name is None else self.slot_value(process, name, span)

    def slot_value(self, process: Process, name: str, span: Span) -> Value:
        """Return what a kept name holds."""
        if self.type_of(name).kind is VariableKind.FRAME:
            self.update_frame(process, name)
            if not self.has_pose(name):
                text = f"frame `{self.spelling(name)}` is used before it has a value"
                raise self.error(process, "E304", text, span, "no value here")
            return self.state.tree.world(name)
        if (value := self.state.values.get(name)) is None:
            text = f"`{self.spelling(name)}` is used before it has a value"
            raise self.error(process, "E303", text, span, "no value here")
        return value

    def read_number(self, process: Process, operand: Operand, span: Span) -> float:
        """Return the value of an operand that is a number."""
        value = self.read(process, operand, span)
        assert isinstance(value, float | int)  # noqa: S101 - the checker knows the kinds
        return float(value)

    def read_pose(self, process: Process, operand: Operand, span: Span) -> Array:
        """Return the value of an operand that is a pose or a step."""
        value = self.read(process, operand, span)
        assert isinstance(value, np.ndarray)  # noqa: S101 - the checker knows the kinds
        return value

    def write(self, process: Process, operand: Operand, value: Value, span: Span) -> None:
        """Give a variable, an element or a value in passing its value."""
        assert isinstance(operand, str)  # noqa: S101 - the translator names what is written
        if operand.startswith("%") and not isinstance(process.activation.temporaries.get(operand), ElementReference):
            process.activation.temporaries[operand] = value
            process.activation.temporary_spans[operand] = span
            return
        name = self.resolve_name(process, operand)
        if self.type_of(name).kind is not VariableKind.FRAME:
            assert not isinstance(value, ElementReference)  # noqa: S101 - elements are read before they are written
            self.state.values[name] = value
            return
        assert isinstance(value, np.ndarray)  # noqa: S101 - the checker knows the kinds
        self.set_pose(process, name, value, span)
        text, data = f"{self.spelling(name)} = {value_text(value, self.code.units)}", pose_data(name, value)
        self.record_effect(process, "PLACE", text, span, data=data)

    def has_pose(self, name: str) -> bool:
        """Whether a frame stands somewhere."""
        return name in self.state.tree and self.state.tree.has_value(name)

    def operand_text(self, process: Process, operand: Operand) -> str:
        """Return what an operand is called in the trace: as the program writes it."""
        name = self.variable_name(process, operand)
        if name is None:
            return " ".join(self.code.source.slice(process.activation.temporary_spans[str(operand)]).split())
        return self.spelling(name)

    def spelling(self, name: str) -> str:
        """Return a kept name as the program writes it."""
        return self.code.spelled(name)

    def set_pose(self, process: Process, name: str, X: Array, span: Span) -> None:
        """Give a frame another pose.

        Raises:
            RunError: it cannot be placed.
        """
        self.update_frame(process, name)
        leader = self.state.tree.rigid_root(name)
        if is_arm(name) or name == WORLD:
            text = f"`{self.spelling(name)}` cannot be assigned a value"
            raise self.error(process, "E218", text, span, "an arm" if is_arm(name) else "the root of all frames")
        self.require_placeable(process, leader, span)
        if leader != name and (is_arm(leader) or leader == WORLD):
            attached = f"`{self.spelling(name)}` is rigidly attached to {self.spelling(leader)}"
            text = f"{attached}, which an assignment cannot move"
            raise self.error(process, "E310", text, span, "cannot be assigned a pose")
        self.replace_tree(self.state.tree.set_pose(name, X), name, span)

    def update_hand_pose(self, arm: str, span: Span, *, tick: int | None = None) -> None:
        """Let the frame table know where an arm is now, or will be at a later tick."""
        self.replace_tree(self.state.tree.set_pose(arm, self.gripper_pose(arm, tick)), arm, span)

    def base_pose(self, arm: str) -> Array:
        """Return the pose X_WB of the base of an arm in the world."""
        return self.state.tree.world(base_name(arm))

    def gripper_pose(self, arm: str, tick: int | None = None) -> Array:
        """Return the pose of the gripper of an arm in the world, now or at a later tick."""
        q = self.hardware.configuration(arm, self.now if tick is None else tick * self.cell.period)
        return self.base_pose(arm) @ forward(self.cell.arms[arm].arm, q)

    def carrier(self, name: str) -> str | None:
        """Return the arm that a frame is or hangs on; None where it hangs on none."""
        return next((frame for frame in (name, *self.state.tree.ancestors(name)) if is_arm(frame)), None)

    def moving_frame(self, name: str) -> str | None:
        """Return the frame that moves by itself which a frame is or hangs on; None where it hangs on none."""
        moving = self.cell.moving_frames
        frames = (name, *self.state.tree.ancestors(name)) if moving else ()
        return next((frame for frame in frames if frame in moving), None)

    def moving_frame_named(self, process: Process, step: Instruction) -> str:
        """Return the frame that moves by itself which the operand of an instruction names.

        Raises:
            RunError: it is none.
        """
        name = self.resolve_name(process, step.operands[0])
        if name not in self.cell.moving_frames:
            known = f"frames of the cell that move: {', '.join(sorted(self.cell.moving_frames)) or 'none'}"
            text = f"`{self.spelling(name)}` is no frame of the cell that moves"
            raise self.error(process, "E249", text, step.span, "nothing to track", notes=[known])
        return name

    def require_placeable(self, process: Process, name: str, span: Span) -> None:
        """See to it that a frame may be placed and attached: the cell moves some.

        Raises:
            RunError: the cell moves it.
        """
        if name in self.cell.moving_frames:
            text = f"`{self.spelling(name)}` is moved by the cell, and cannot be placed or attached"
            advice = f"affix a frame of the program to `{self.spelling(name)}`"
            raise self.error(process, "E249", text, span, "moves by itself", helps=[advice])

    def loaded_arm(self, name: str) -> Arm:
        """Return the model of an arm with the parts that it holds now."""
        if not self.cell.parts:
            return self.cell.arms[name].arm
        parts = self.hardware.part_poses()
        return loaded_arm(self.cell, name, [(part, parts.pose(part)) for part in parts.held_by(name)])

    def ticks_run(self, duration: float) -> int:
        """Return how many servo ticks of a motion that begins now are run: a run comes to its end at its time limit."""
        period = self.cell.period
        return min(round(duration / period), math.ceil(max(0.0, self.limits.time - self.now) / period))

    def moving_process(self, arm: str) -> Process | None:
        """Return the process that moves an arm; None where the arm is at rest."""
        return next((owner for owner in self.state.processes if owner.motion and owner.motion.arm == arm), None)

    def origin_labels(self, name: str, text: str) -> list[Label]:
        """Return a text about the statement that gave a frame its pose or its parent; nothing where none did."""
        return [Label(self.state.pose_origins[name], text)] if name in self.state.pose_origins else []

    def update_frame(self, process: Process, name: str) -> None:
        """Let the frame table know where a frame is now, if a moving arm carries it."""
        if name not in self.state.tree:
            return
        if (mobile := self.moving_frame(name)) is not None:
            X_WF = self.cell.moving_frames[mobile].pose_at(self.now)
            self.state.tree = self.state.tree.set_pose(mobile, X_WF)
        if not (self.state.following or any(process.motion for process in self.state.processes)):
            return
        arm = self.carrier(name)
        if arm in self.state.following:
            self.state.tree = self.state.tree.set_pose(arm, self.gripper_pose(arm))
        mover = None if arm is None else self.moving_process(arm)
        # A condition of a MOVE finds the arm of this MOVE where it is.
        if arm is not None and mover is not None and not (mover is process and process.activation.kind == "condition"):
            self.state.tree = self.state.tree.set_pose(arm, self.gripper_pose(arm))

    def replace_tree(self, tree: FrameTree, name: str, span: Span) -> None:
        """Take another frame tree, in which ``name`` got its pose or its parent."""
        self.state.tree = tree
        self.state.pose_origins[name] = span
        if len(self.state.trees) > 1 and self.state.trees[-1][0] == self.now:
            self.state.trees.pop()
        self.state.trees.append((self.now, tree))
        if len(self.state.trees) > 2 * _MAX_TREES:
            self.state.trees = thin_trees(self.state.trees, self.now / _MAX_TREES)

    # ---- arms and time ---------------------------------------------------------------------------------------------

    def claim_arm(self, process: Process, arm: str, span: Span, moved: str | None = None) -> None:
        """Let a process use an arm.

        Args:
            process: that uses it.
            arm: the arm.
            span: the statement.
            moved: the frame on the arm that the statement moves, if it does not name the arm itself.

        Raises:
            RunError: the cell has no such arm, or it belongs to another branch.
        """
        if arm not in self.cell.arms:
            note = f"arms: {', '.join(sorted(self.cell.arms)) or 'none'}"
            raise self.error(process, "E302", f"the cell has no arm {arm}", span, "no such arm", notes=[note])
        process.last_arm = arm
        owners = self.state.owners.setdefault(arm, [])
        owners[:] = [owner for owner in owners if not owner.done]
        for owner in owners:
            if not (owner.descends_from(process) or process.descends_from(owner)):
                text = f"{arm} is used by {owner.title} and by {process.title} of one COBEGIN"
                label, notes = f"belongs to {owner.title}", ["each arm belongs to one process at a time"]
                secondary = self._affix_labels(moved, arm)
                raise self.error(process, "E503", text, span, label, secondary=secondary, notes=notes)
        if process not in owners:
            owners.append(process)

    def _affix_labels(self, moved: str | None, arm: str) -> list[Label]:
        """Return where a frame, or what it hangs on, was hung on an arm."""
        if moved is None or moved == arm:
            return []
        chain = [moved, *self.state.tree.ancestors(moved)]
        name = chain[chain.index(arm) - 1]
        return self.origin_labels(name, f"{self.spelling(name)} was affixed to {arm} here")

    def schedule_effect(self, process: Process, seconds: float, pending: PendingEffect) -> None:
        """Let the time of a statement go by before it takes effect."""
        process.pending_effect = pending
        process.wake_tick = self.state.ticks + math.ceil(seconds / self.cell.period - _TICK_TOLERANCE)

    def next_start(self) -> StartTime:
        """Return the present tick as the start of what takes time, behind all that has begun before."""
        self.state.start_count += 1
        return StartTime(self.state.ticks, self.state.start_count)

    def record_effect(
        self,
        process: Process,
        kind: EffectKind,
        text: str,
        span: Span,
        *,
        since: StartTime | None = None,
        until: int | None = None,
        arm: str | None = None,
        data: Mapping[str, object] | None = None,
    ) -> None:
        """Record what a process did up to now, or does up to a later tick."""
        start, period = since or self.next_start(), self.cell.period
        self.state.effects.append(
            Effect(
                t0=start.tick * period,
                t1=self.now if until is None else until * period,
                kind=kind,
                span=span,
                text=text,
                process=process.title,
                order=start.order,
                arm=arm,
                data=data or {},
            )
        )

    def count_step(self, process: Process, span: Span) -> None:
        """Count an instruction.

        Raises:
            RunError: there have been too many without any time going by.
        """
        self.state.idle_steps += 1
        self.state.step_tick = self.state.ticks
        if self.state.idle_steps > self.limits.steps:
            text = f"the program has executed {self.limits.steps} steps, and no time has passed"
            help_ = "a loop needs a MOVE, a PAUSE or a WAIT in it, or an end"
            raise self.error(process, "E504", text, span, "it is running this statement", helps=[help_])

    # ---- errors ----------------------------------------------------------------------------------------------------

    def error(
        self,
        process: Process,
        code: str,
        message: str,
        span: Span,
        label: str,
        *,
        secondary: Sequence[Label] = (),
        notes: Sequence[str] = (),
        helps: Sequence[str] = (),
    ) -> RunError:
        """Return the error that says why a process cannot go on."""
        calls = [
            Label(activation.call_span, f"{self.spelling(activation.name)} is called here")
            for activation in process.stack[:0:-1]
            if activation.kind == "procedure" and activation.call_span
        ]
        diagnostic = Diagnostic(
            code=code,
            message=message,
            span=span,
            label=label,
            secondary=(*secondary, *list(dict.fromkeys(calls))[:3]),
            notes=tuple(notes),
            helps=tuple(helps),
        )
        return RunError(diagnostic, self.state.tree, self.now)


def constant_values(constants: Sequence[tuple[float, ...] | float]) -> list[float | Array]:
    """Return the constants of a code as values: numbers, and poses (4, 4)."""
    return [from_noap(value) if isinstance(value, tuple) else float(value) for value in constants]


def pose_data(frame: str, X: Array) -> dict[str, object]:
    """Return the facts of an effect that gives a frame a pose."""
    return {"frame": frame, "pose": to_noap(X).tolist()}


def jump_target(step: Instruction, operand: int) -> int:
    """Return the index of the instruction that an operand of another leads to."""
    target = step.operands[operand]
    assert isinstance(target, JumpTarget)  # noqa: S101 - the translator lands them
    return target.index


# Executes an instruction for a process.
Handler: TypeAlias = Callable[[Machine, Process, Instruction], None]
