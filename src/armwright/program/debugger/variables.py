"""What a debugger shows of a run that stands still: variables, frames, arms and the clock, one inside the other."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.program.debugger.snapshot import StackFrame
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Process, RingQueue, Value
from armwright.program.vm.value_text import frames_with_depth, matrix_text, noap_texts

_NO_VALUE = "no value yet"
# Less than this of a number between -1 and 1 is rounding.
_ROUNDING = 1e-9


@attrs.frozen(kw_only=True)
class Variable:
    """A variable, or a group of them, as a line that can be opened.

    Attributes:
        name: what it is.
        value: for people; of what can be changed, as the program could write it.
        type: what kind of thing it is.
        children: gives the lines inside of it; None where there are none.
        element_count: how many of those are elements of an array.
        expression: what asks for it again; empty where nothing does.
        slot: where it is kept, if it is a variable, an element or an arm.
    """

    name: str
    value: str
    type: str = ""
    children: Callable[[], "Sequence[Variable]"] | None = None
    element_count: int = 0
    expression: str = ""
    slot: str | None = None


def scopes(machine: Machine, frame: StackFrame) -> list[Variable]:
    """Return what there is to see from one level of a stack.

    Args:
        machine: as it is seen now.
        frame: the level.
    """
    local_types = {} if frame.procedure is None else machine.code.procedures[frame.procedure].types
    # Of a branch in the program itself, or of a procedure that has no names, there is nothing own to be seen.
    local = {key: slot for key, slot in frame.activation.bindings.items() if key in local_types}
    records = machine.code.records
    values = {
        key: key
        for key, kind in machine.code.types.items()
        if kind.sizes or kind.kind is not VariableKind.FRAME or key.rpartition(".")[0] in records
    }
    local_records = {} if frame.procedure is None else machine.code.procedures[frame.procedure].records
    parts: list[tuple[str, Callable[[], Sequence[Variable]]]] = [
        ("Locals", lambda: _variables(machine, local, local_records)),
        ("Variables", lambda: _variables(machine, values, records)),
        ("Frames", lambda: [make_variable(machine, name) for name in frame_names(machine)]),
        ("Arms", lambda: [_arm_variable(machine, name) for name in machine.cell.arms]),
        ("Run", lambda: list(_run_variables(machine, frame.process))),
    ]
    contents = {"Locals": local, "Variables": values}
    return [Variable(name=name, value="", children=inside) for name, inside in parts if contents.get(name, True)]


def _variables(machine: Machine, slots: Mapping[str, str], records: Mapping[str, str]) -> list[Variable]:
    """Return variables by key and where they are kept, and records in the place of their fields."""
    grouped: dict[str, dict[str, str]] = {}
    for key, slot in slots.items():
        record, _, field = key.rpartition(".")
        grouped.setdefault(record if record in records else key, {})[field] = slot
    return [
        record_variable(machine, _record_name(machine, key, fields), records[key], fields)
        if key in records
        else make_variable(machine, slots[key], name=machine.spelling(key))
        for key, fields in grouped.items()
    ]


def _record_name(machine: Machine, key: str, fields: Iterable[str]) -> str:
    """Return the name of a record as the names of its fields spell it."""
    return next((machine.spelling(f"{key}.{field}").rpartition(".")[0] for field in fields), machine.spelling(key))


def record_variable(machine: Machine, name: str, type_name: str, slots: Mapping[str, str]) -> Variable:
    """Return a record with its fields inside, or an array of records.

    Args:
        machine: as it is seen now.
        name: what to call it.
        type_name: its type.
        slots: where each field is kept, by its key.
    """
    sizes = next((machine.type_of(slot).sizes for slot in slots.values()), ())
    if sizes:

        def element(which: str) -> Variable:
            kept = {field: slot + which for field, slot in slots.items()}
            return record_variable(machine, name + which, type_name, kept)

        elements, kind = ArrayElements(element, sizes), f"ARRAY [{','.join(map(str, sizes))}] OF {type_name}"
        text = f"{len(elements)} elements"
        return Variable(
            name=name, value=text, type=kind, children=lambda: elements, element_count=len(elements), expression=name
        )
    inside = []
    for slot in slots.values():
        field = machine.spelling(slot).rpartition(".")[2]
        inside.append(attrs.evolve(make_variable(machine, slot, name=field), expression=f"{name}.{field}"))
    text = ", ".join(f"{field.name} = {field.value}" for field in inside)
    return Variable(name=name, value=text, type=type_name, children=lambda: inside, expression=name)


def frame_names(machine: Machine) -> list[str]:
    """Return the single frames of a program and its cell, bases of arms and variables of procedures aside."""
    return [
        name
        for name in machine.state.tree
        if name != WORLD and not name.endswith(".BASE") and not set(name) & set("'[")
    ]


def make_variable(machine: Machine, slot: str, *, name: str = "") -> Variable:
    """Return a variable, an element, an array or the gripper of an arm.

    Args:
        machine: as it is seen now.
        slot: where it is kept.
        name: what to call it; as the program spells it when left out.
    """
    kind = machine.type_of(slot)
    name = name or machine.spelling(slot)
    if kind.sizes:
        entry = _array_variable(machine, slot, name, kind)
    elif kind.kind is VariableKind.EVENT:
        entry = Variable(name=name, value=str(machine.state.events.get(slot, 0)), type="EVENT")
    elif kind.kind is VariableKind.FRAME:
        entry = _frame_variable(machine, slot, name)
    elif (value := machine.state.values.get(slot)) is None:
        entry = Variable(name=name, value=_NO_VALUE, type=str(kind))
    else:
        entry = value_variable(machine, name, value, str(kind))
    return attrs.evolve(entry, expression=name, slot=slot)


def value_variable(machine: Machine, name: str, value: Value, kind: str) -> Variable:
    """Return a value that stands for itself."""
    if isinstance(value, np.ndarray):
        text = _pose_text(machine, value)
        return Variable(name=name, value=text, type=kind, children=lambda: _pose_columns(machine, value))
    if isinstance(value, str):
        return Variable(name=name, value=f'"{value}"', type=kind)
    return Variable(name=name, value=str(value).lower() if isinstance(value, bool) else f"{value:.12g}", type=kind)


def frame_tree_lines(machine: Machine) -> list[str]:
    """Return the tree of frames, a line each, what hangs on something under it."""
    _, *frames = frames_with_depth(machine.state.tree, sorted)
    spelling = machine.spelling
    return [WORLD, *(f"{'  ' * depth}{spelling(name)}  {_position_text(machine, name)}" for name, depth in frames)]


# ---- frames, steps, arrays -----------------------------------------------------------------------------------------


def _frame_variable(machine: Machine, slot: str, name: str) -> Variable:
    if not machine.has_pose(slot):
        return Variable(name=name, value=_NO_VALUE, type="FRAME")
    parent = machine.state.tree.parent(slot)
    kind = "FRAME" if parent is None else f"FRAME on {_parent_name(machine, parent)}"
    value = _pose_text(machine, machine.state.tree.world(slot))
    return Variable(name=name, value=value, type=kind, children=lambda: _frame_contents(machine, slot))


def _frame_contents(machine: Machine, slot: str) -> list[Variable]:
    lines = _pose_columns(machine, machine.state.tree.world(slot))
    parent = machine.state.tree.parent(slot)
    if parent is not None:
        parent_name = _parent_name(machine, parent)
        X = machine.state.tree.relation(slot, parent)
        inside = make_variable(machine, parent).children if parent != WORLD else None
        entry = Variable(name="parent", value=parent_name, type="FRAME", children=inside, expression=parent_name)
        lines += [entry, value_variable(machine, "relation", X, "TRANS")]
        if machine.state.tree.nodes[slot].rigid:
            lines.append(Variable(name="rigid", value="true"))
    if slot in machine.state.pose_origins:
        line = machine.code.source.place(machine.state.pose_origins[slot].start)
        lines.append(Variable(name="set in line", value=str(line)))
    return lines


def _parent_name(machine: Machine, parent: str) -> str:
    return f"the base of {parent.removesuffix('.BASE')}" if parent.endswith(".BASE") else machine.spelling(parent)


def _pose_columns(machine: Machine, X: Array) -> list[Variable]:
    numbers = _pose_numbers(machine, X)
    units = ("", "", "", machine.code.units.length.lower())
    texts = [f"({', '.join(numbers[index : index + 3])})" for index in range(0, 12, 3)]
    return [Variable(name=name, value=text, type=unit) for name, text, unit in zip("noap", texts, units, strict=True)]


def _pose_text(machine: Machine, X: Array) -> str:
    """Return a pose or a step as the program would write it."""
    return matrix_text(_pose_numbers(machine, X))


def _pose_numbers(machine: Machine, X: Array) -> list[str]:
    return noap_texts(X, machine.code.units, 7, _ROUNDING)


def _position_text(machine: Machine, name: str) -> str:
    if not machine.has_pose(name):
        return _NO_VALUE
    position = ", ".join(_pose_numbers(machine, machine.state.tree.world(name))[9:])
    return f"({position}) {machine.code.units.length.lower()}"


def _array_variable(machine: Machine, slot: str, name: str, kind: VariableType) -> Variable:
    def element(which: str) -> Variable:
        return make_variable(machine, slot + which, name=name + which)

    elements, text = ArrayElements(element, kind.sizes), f"{math.prod(kind.sizes)} elements"
    return Variable(name=name, value=text, type=str(kind), children=lambda: elements, element_count=len(elements))


class ArrayElements(Sequence[Variable]):
    """The elements of an array, made when they are looked at: there may be a million."""

    def __init__(self, make_element: Callable[[str], Variable], sizes: tuple[int, ...]) -> None:
        self._make_element, self._sizes = make_element, sizes

    def __len__(self) -> int:
        return math.prod(self._sizes)

    def __getitem__(self, index: "int | slice") -> "Variable | list[Variable]":  # type: ignore[override]
        if isinstance(index, slice):
            return [self._element(value) for value in range(*index.indices(len(self)))]
        return self._element(range(len(self))[index])

    def _element(self, number: int) -> Variable:
        indices = []
        for size in reversed(self._sizes):
            number, index = divmod(number, size)
            indices.append(str(index + 1))
        which = f"[{','.join(reversed(indices))}]"
        return attrs.evolve(self._make_element(which), name=which)


# ---- arms and the run ----------------------------------------------------------------------------------------------


def _arm_variable(machine: Machine, name: str) -> Variable:
    arm = machine.cell.arms[name].arm
    q = machine.hardware.configuration(name, machine.now)
    texts = [
        f"{math.degrees(position):.6g} deg" if joint.revolute else f"{position * 1e3:.6g} mm"
        for joint, position in zip(arm.joints, q.tolist(), strict=True)
    ]
    joints = [Variable(name=f"joint {number}", value=text) for number, text in enumerate(texts, 1)]

    def children() -> list[Variable]:
        holds = machine.state.hands[name].held_frame
        wrench = machine.hardware.contact_wrench(name, machine.now).tolist()
        hand = value_variable(machine, "hand", machine.gripper_pose(name), "FRAME")
        queue = machine.state.queues.get(name)
        queues = [] if queue is None else [Variable(name="queue", value=_queue_text(machine, queue))]
        return [
            *joints,
            attrs.evolve(hand, expression=name, slot=name),
            Variable(name="moves", value=_motion_text(machine, name)),
            *queues,
            Variable(name="holds", value=machine.spelling(holds) if holds else "nothing"),
            Variable(name="force", value=f"({', '.join(f'{component:.6g}' for component in wrench[:3])}) N"),
            Variable(name="torque", value=f"({', '.join(f'{component:.6g}' for component in wrench[3:])}) N m"),
        ]

    return Variable(name=name, value=", ".join(texts), type=arm.name, children=children)


def _queue_text(machine: Machine, queue: RingQueue) -> str:
    """Return how many frames of a queue are ahead of its arm, and which."""
    ahead = queue.ahead(machine.now)
    frames = ", ".join(queue.labels[len(queue.labels) - ahead :])
    return f"{ahead} of {queue.capacity}{': ' if frames else ''}{frames}"


def _motion_text(machine: Machine, arm: str) -> str:
    """Return which stage of which MOVE an arm is in."""
    process = machine.moving_process(arm)
    if process is None or process.motion is None:
        return "nothing"
    motion = process.motion
    stage = machine.state.stages[motion.stage_index]
    line = machine.code.source.place(motion.span.start)
    since = machine.now - stage.t0
    return f"{stage.stage.kind} {' '.join(stage.goal_names)} of line {line}, {since:.3f} s of {stage.duration:.3f} s"


def _run_variables(machine: Machine, process: Process) -> Iterable[Variable]:
    yield Variable(name="clock", value=f"{machine.now:.6g} s")
    yield Variable(name="servo tick", value=str(machine.state.ticks))
    devices = ", ".join(map(machine.spelling, sorted(machine.hardware.active_devices())))
    yield Variable(name="devices on", value=devices or "none")
    yield Variable(name="arm used last", value=process.last_arm or "none")
    if process.ahead is not None:
        waiting = ", ".join(request.form.goal for request in process.ahead.requests)
        yield Variable(name="MOVEs that wait for the next", value=waiting)
    if process.message:
        yield Variable(name="message", value=f'"{process.message}"')
    yield Variable(name="priority", value=f"{process.priority:g}")
    if process.locks:
        yield Variable(name="locks", value=", ".join(map(machine.spelling, process.locks)))
