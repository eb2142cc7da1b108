"""Program mode for FANUC's pendant: registers, labels and called programs; targets are joint positions.

The language cannot compute with poses, so frames are worked out here. Each way through the program on which the frames
stand elsewhere gets positions of its own, and a procedure a program of its own for each place that it is called for.
"""

import math
import re
from collections.abc import Iterable, Iterator
from typing import NoReturn, assert_never

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.export.refusals import ExportError
from armwright.export.translation.code import (
    Assign,
    Call,
    Choice,
    Count,
    FunctionCall,
    Halt,
    Loop,
    MoveTo,
    Number,
    Operation,
    Pause,
    Pose,
    Print,
    ProgramCode,
    Return,
    Statement,
    Switch,
    Truth,
    Value,
    Variable,
    WaitUntil,
    values_of,
)
from armwright.export.writers.controller_file import ControllerFile
from armwright.export.writers.fanuc import (
    COMMON,
    MOST_LINES,
    NAME_LIMIT,
    REPLACED,
    TEXT_LIMIT,
    TO_START,
    file_text,
    position,
    time_text,
    tool_lines,
    wait_text,
)
from armwright.export.writers.fanuc_text import FIRST_REGISTER, FanucText
from armwright.export.writers.known_values import KnownValues
from armwright.export.writers.program_text import (
    MILLIMETRES,
    Names,
    chunks_of_text,
    is_whole,
    number_of,
    program_approximations,
    program_heading,
    scaled,
)
from armwright.export.writers.reserved_words import FANUC
from armwright.export.writers.text import identifier, plain_lines
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import nearest_configurations
from armwright.program.language.units import NORMAL_SPEED
from armwright.spatial.rotations import angle_between

# Loops that are written out have no more passes.
_MOST_PASSES = 200
# A way of the tool that is none [m, rad], and joint positions that are the same [rad].
_NEAR = 1e-6
# What begins the keys of functions that stand for a camera.
_CAMERA = "CAMERA "
# Shortest and longest pulse, and its digits [s].
_SHORTEST_PULSE, _LONGEST_PULSE, _PULSE_DIGITS = 0.1, 25.5, 1
_CENTISECONDS, _LONGEST_WAIT = 100, 300.0


def write(code: ProgramCode) -> ControllerFile:
    """Return a program of the pendant, and those that it calls.

    Raises:
        ExportError: it needs what the language has not; the message has the line and the reason.
    """
    try:
        return _Writer(code, eager=False).file()
    except ExportError as error:
        if error.diagnostic.code != "E620":
            raise
    # Frames that are placed in a FOR may be needed behind it.
    return _Writer(code, eager=True).file()


@attrs.define
class _Body:
    """What belongs to one program of the controller while it is written."""

    positions: list[str] = attrs.field(factory=list)
    labels: int = 0


@attrs.define(kw_only=True, eq=False)
class _Version:
    """A procedure as it is called from where certain things are known, and what is known behind it."""

    key: str
    before: KnownValues
    after: KnownValues
    ends: bool
    written: int


class _Writer:
    """A program while it is written; an eager one writes out FORs in which frames are placed that it cannot know."""

    def __init__(self, code: ProgramCode, *, eager: bool) -> None:
        self._code, self._text = code, FanucText(code)
        self._procedures = {one.key: one for one in code.procedures}
        self._body, self._ended = _Body(), False
        # How many FORs around a statement are tried as loops, and the lines of those that are written out.
        self._eager, self._attempts, self._written_out = eager, 0, set[str]()
        # Lines of MOVEs that lead to places to which they do not in the run.
        self._unseen: set[str] = set()
        self._versions: list[_Version] = []
        # Programs that are called: the key of the procedure, lines, positions.
        self._called: list[tuple[str, list[str], list[str]]] = []

    def file(self) -> ControllerFile:
        """Return the file, with those of the programs that it calls."""
        code = self._code
        name = identifier(code.name, NAME_LIMIT, FANUC).upper()
        start = self._position(code.placed.start)
        lines = [
            f"  !{line}"
            for part in program_heading(code).split(", ")
            for line in plain_lines(part, REPLACED, TEXT_LIMIT)
        ]
        lines += [*tool_lines(code.mapped), f"J {start} {TO_START} FINE"]
        for one in code.declarations:
            # Those with a blank are the translation's own, and are set before they are read.
            if not one.sizes and one.kind != "pose" and " " not in one.key:
                lines.append(f"  {self._text.text(Variable(one.key))}={self._text.text(one.initial)}")
        lines += self._block(code.statements)
        if not self._ended:
            lines += self._outputs_off()
        names = Names(NAME_LIMIT, {*FANUC, name.lower()})
        files = self._files(name, lines, names)
        return ControllerFile(
            name=f"{name}.ls",
            text=files.pop(f"{name}.ls"),
            approximations=tuple(self._approximations()),
            others=tuple(files.items()),
        )

    def _files(self, name: str, lines: list[str], names: Names) -> dict[str, str]:
        """Return the texts of a program and of those that it calls, which get their names now."""
        known: dict[int, str] = {}
        waiting = [(name, lines, self._body.positions)]
        files: dict[str, str] = {}

        def named(found: re.Match[str]) -> str:
            number = int(found[1])
            if number not in known:
                key, inside, positions = self._called[number]
                known[number] = names.fresh(key.partition("#")[0]).upper()
                waiting.append((known[number], inside, positions))
            return known[number]

        while waiting:
            called, own, positions = waiting.pop(0)
            if len(own) > MOST_LINES:
                self._refuse_lines()
            written = [re.sub("\0(\\d+)\0", named, line) for line in own]
            files[f"{called}.ls"] = file_text(called, written, positions)
        return files

    def _refuse_lines(self) -> NoReturn:
        text = f"the program takes more than {MOST_LINES:,} lines, which controllers of FANUC do not bear"
        self._text.refuse(text, code="E617")

    def _approximations(self) -> Iterator[str]:
        code = self._code
        yield from COMMON
        yield "the axis speeds of the controller at 100 % are taken to be the speed limits of the arm"
        yield "speeds are whole percents, mm/s or degrees per second from 1 on, the next smaller ones where constant"
        yield f"registers and flags from {FIRST_REGISTER} on hold the variables, and are overwritten"
        yield from program_approximations(code, rounded=False)
        if any(isinstance(one, WaitUntil) and one.limit is not None for one in code.everything()):
            yield "$WAITTMOUT of the controller is overwritten, in hundredths of a second"
        for line in sorted(self._written_out):
            yield f"line {line}: frames depend on the variable of this FOR: its passes stand one after the other"
        for line in sorted(self._unseen):
            yield f"line {line}: the run does not come to all places of this MOVE: their postures are the nearest ones"
        yield "frames are worked out before: positions are joints, and change only where the program is exported again"

    # ---- blocks ----------------------------------------------------------------------------------------------------

    @property
    def _known(self) -> KnownValues:
        return self._text.known

    def _block(self, statements: Iterable[Statement]) -> list[str]:
        lines: list[str] = []
        for statement in statements:
            if self._ended:
                break
            self._text.span = statement.span
            lines += self._lines(statement)
        return lines

    def _label(self) -> str:
        self._body.labels += 1
        return f"LBL[{self._body.labels}]"

    def _mark(self) -> tuple[KnownValues, int, int]:
        return self._known.copy(), self._body.labels, len(self._body.positions)

    def _back_to(self, mark: tuple[KnownValues, int, int]) -> None:
        """Forget what has been written since."""
        self._text.known, self._body.labels = mark[0].copy(), mark[1]
        del self._body.positions[mark[2] :]
        self._ended = False

    def _join(self, known: KnownValues, *, ended: bool) -> None:
        """Another way leads here too, unless it has ended."""
        if self._ended:
            self._text.known, self._ended = known, ended
        elif not ended:
            self._text.known = self._known.joined(known)

    # ---- statements ------------------------------------------------------------------------------------------------

    def _lines(self, statement: Statement) -> Iterator[str]:  # noqa: C901, PLR0912 - one case per kind
        text = self._text
        match statement:
            case Assign():
                yield from self._assign(statement)
            case MoveTo():
                yield from self._move(statement)
            case Switch():
                yield self._switch(statement)
            case Pause(seconds=seconds):
                yield from self._pause(seconds)
            case Print(items=items):
                yield from (f"  MESSAGE[{line}]" for line in self._message(items))
            case WaitUntil():
                yield from self._wait(statement)
            case Choice(condition=condition, then=then, otherwise=otherwise) if isinstance(
                always := text.plain(condition), Truth
            ):
                yield from self._block(then if always.value else otherwise)
            case Choice(condition=condition, then=then, otherwise=otherwise):
                yield f"  IF {text.condition(condition)} THEN"
                before = self._known.copy()
                yield from self._block(then)
                after, ended = self._known, self._ended
                text.known, self._ended = before, False
                inside = self._block(otherwise)
                if inside:
                    yield from ("  ELSE", *inside)
                self._join(after, ended=ended)
                yield "  ENDIF"
            case Loop():
                yield from self._loop(statement)
            case Count():
                yield from self._count(statement)
            case Call():
                yield from self._call(statement)
            case Return():
                text.refuse("a called program has no value")
            case Halt():
                yield from (*self._outputs_off(), "  ABORT")
                self._ended = True
            case _:
                assert_never(statement)

    def _assign(self, one: Assign) -> Iterator[str]:
        if any(isinstance(value, FunctionCall) and value.procedure.startswith(_CAMERA) for value in values_of(one)):
            self._text.refuse("where the camera sees a frame is known only while the program runs", code="E620")
        known = self._known.value(one.value)
        if self._code.kinds[one.target.key] != "pose":
            yield f"  {self._text.text(one.target)}={self._text.text(one.value)}"
        elif known is None and (
            (self._eager and self._attempts) or any(isinstance(each, FunctionCall) for each in values_of(one.value))
        ):
            self._text.refuse("this pose is known only while the program runs", code="E620")
        self._known.set(one.target, known)

    def _switch(self, one: Switch) -> str:
        output = f"DO[{number_of(self._code, one.address, one.name, one.span, least=1)}]"
        if one.pulse is None:
            return f"  {output}={self._text.truth(one.on)}"
        known = self._known.value(one.pulse)
        seconds = known.value if isinstance(known, Number) else 0.0
        if not _SHORTEST_PULSE <= seconds <= _LONGEST_PULSE or round(seconds, _PULSE_DIGITS) != seconds:
            text = f"a PULSE of FANUC takes a constant time from {_SHORTEST_PULSE} s to {_LONGEST_PULSE} s in tenths"
            self._text.refuse(text, "write OPERATE and PAUSE")
        return f"  {output}=PULSE,{seconds:.1f}sec"

    def _pause(self, seconds: Value) -> Iterator[str]:
        if isinstance(seconds, Number):
            yield f"  WAIT {wait_text(seconds.value)}(sec)"
            return
        register = self._text.register("SECONDS")
        yield from (f"  {register}={self._text.text(seconds)}", f"  WAIT {register}")

    def _message(self, items: Iterable[str | Value]) -> Iterator[str]:
        """Give the lines of a text, broken behind blanks where there are some."""
        shown = ""
        for part in chunks_of_text(items):
            known = part if isinstance(part, str) else self._known.value(part)
            if isinstance(known, Number):
                shown += f"{known.value:.6g}"
            elif isinstance(known, Truth):
                shown += str(known.value).upper()
            elif isinstance(known, str):
                shown += known
            else:
                self._text.refuse(
                    "MESSAGE shows texts, and no number that is known only while the program runs", code="E620"
                )
        line = ""
        for word in re.findall(r"\S*\s*", shown):
            if line and len(line) + len(word) > TEXT_LIMIT:
                yield from plain_lines(line, REPLACED, TEXT_LIMIT)
                line = ""
            line += word
        yield from plain_lines(line, REPLACED, TEXT_LIMIT)

    def _wait(self, one: WaitUntil) -> Iterator[str]:
        condition = self._text.condition(one.condition)
        if one.limit is None:
            yield f"  WAIT {condition}"
            return
        limit = self._known.value(one.limit)
        if not isinstance(limit, Number) or not 0 <= limit.value <= _LONGEST_WAIT:
            self._text.refuse(f"the time of WITHIN has to be constant for FANUC, and {_LONGEST_WAIT:g} s at most")
        late, over = self._label(), self._label()
        yield f"  $WAITTMOUT={max(math.ceil(limit.value * _CENTISECONDS - _NEAR), 1)}"
        yield from (f"  WAIT {condition} TIMEOUT,{late}", f"  JMP {over}", f"  {late}")
        before = self._known.copy()
        yield from self._block(one.late)
        self._join(before, ended=False)
        yield f"  {over}"

    # ---- loops and calls -------------------------------------------------------------------------------------------

    def _loop(self, one: Loop) -> list[str]:
        while True:
            mark = self._mark()
            again, out = self._label(), self._label()
            lines, always = [f"  {again}"], False
            if not one.at_end:
                leaves = self._text.plain(Operation("not", (one.condition,)))
                always = leaves == Truth(False)
                lines += self._jump(leaves, out)
            lines += self._block(one.body)
            self._text.span = one.span
            if not self._ended:
                lines += self._jump(self._text.plain(one.condition) if one.at_end else Truth(True), again)
            if self._is_settled(mark):
                break
        if not one.at_end:
            self._text.known, self._ended = mark[0], always
            lines.append(f"  {out}")
        return lines

    def _jump(self, condition: Value, label: str) -> list[str]:
        """Return the jump to a label where a condition holds."""
        if isinstance(condition, Truth):
            return [f"  JMP {label}"] if condition.value else []
        return [f"  IF {self._text.condition(condition)},JMP {label}"]

    def _is_settled(self, mark: tuple[KnownValues, int, int]) -> bool:
        """Whether what was known before a block is known behind it; else go back and know less."""
        joined = mark[0] if self._ended else mark[0].joined(self._known)
        if joined.same_as(mark[0]):
            return True
        self._back_to((joined, *mark[1:]))
        return False

    def _count(self, one: Count) -> list[str]:
        """Return a FOR; where frames depend on its variable, all of its passes are written one after the other."""
        mark, values = self._mark(), self._passes(one, self._known)
        if values is None:
            return self._counted(one)
        self._attempts += 1
        try:
            return self._counted(one)
        except ExportError as error:
            if error.diagnostic.code != "E620":
                raise
        finally:
            self._attempts -= 1
        self._written_out.add(self._code.source.place(one.span.start))
        self._back_to(mark)
        lines: list[str] = []
        for value in values:
            if self._ended:
                break
            assigned = Assign(span=one.span, target=one.variable, value=Number(value))
            lines += self._block((assigned, *one.body))
            if len(lines) > MOST_LINES:
                self._refuse_lines()
        return lines

    def _passes(self, one: Count, known: KnownValues) -> list[float] | None:
        """Return the values of the variable of a FOR; None where they are not known, or too many."""
        first, last = known.value(one.first), known.value(one.last)
        if not isinstance(first, Number) or not isinstance(last, Number):
            return None
        passes = math.floor((last.value - first.value) / one.step + 0.5) + 1
        return [first.value + i * one.step for i in range(passes)] if passes <= _MOST_PASSES else None

    def _counted(self, one: Count) -> list[str]:
        text, counter = self._text, self._text.text(one.counter)
        lines: list[str] = []
        last = one.last
        short = abs(one.step) == 1 and _is_natural(one.first) and is_whole(one.last, text.whole)
        if not short:
            lines.append(f"  {counter}={text.text(one.first)}")
        if one.limit is not None:
            lines.append(f"  {text.text(one.limit)}={text.text(one.last)}")
            last = one.limit
        short = short and (one.limit is not None or _is_natural(last))
        if not short and not lines:
            lines.append(f"  {counter}={text.text(one.first)}")
        for variable in (one.variable, one.counter, one.limit):
            if variable is not None:
                self._known.set(variable, None)
        while True:
            mark = self._mark()
            inside = [f"  {text.text(one.variable)}={counter}", *self._block(one.body)]
            if self._is_settled(mark):
                break
        self._text.known, self._ended, text.span = mark[0], False, one.span
        if short:
            way = "TO" if one.step > 0 else "DOWNTO"
            return [*lines, f"  FOR {counter}={text.text(one.first)} {way} {text.text(last)}", *inside, "  ENDFOR"]
        again, out = self._label(), self._label()
        end = Operation("+", (last, Number(one.step / 2)))
        stop = Operation(">" if one.step > 0 else "<", (one.counter, end))
        step = Operation("+", (one.counter, Number(one.step)))
        lines += [f"  {again}", f"  IF {text.condition(stop)},JMP {out}", *inside]
        return [*lines, f"  {counter}={text.text(step)}", f"  JMP {again}", f"  {out}"]

    def _call(self, one: Call) -> Iterator[str]:
        procedure = self._procedures[one.procedure]
        for (key, _), argument in zip(procedure.parameters, one.arguments, strict=True):
            yield from self._assign(Assign(span=one.span, target=Variable(key), value=argument))
        before = self._known.copy()
        version = next(
            (each for each in self._versions if each.key == procedure.key and each.before.same_as(before)), None
        )
        if version is None:
            version = self._version(procedure.key, before)
        self._text.known, self._ended, self._text.span = version.after.copy(), version.ends, one.span
        yield f"  CALL \0{version.written}\0"

    def _version(self, key: str, before: KnownValues) -> _Version:
        outside, self._body = self._body, _Body()
        try:
            lines = self._block(self._procedures[key].body)
            program = (key, lines, self._body.positions)
        finally:
            self._body = outside
        if program not in self._called:
            self._called.append(program)
        written = self._called.index(program)
        version = _Version(key=key, before=before, after=self._known.copy(), ends=self._ended, written=written)
        self._versions.append(version)
        return version

    def _outputs_off(self) -> list[str]:
        return [f"  DO[{number_of(self._code, address, name, least=1)}]=OFF" for name, address in self._code.outputs]

    # ---- motions ---------------------------------------------------------------------------------------------------

    def _move(self, one: MoveTo) -> Iterator[str]:
        timed = len(one.targets) == 1 and one.passages.reached and one.duration is not None
        for leg, target in enumerate(one.targets):
            place = self._position(self._joints(one, target, leg))
            if timed and one.duration is not None:
                speed = time_text(one.duration)
            else:
                rate, unit = self._line_rate(one, leg) if one.straight else (one.passages.speed_part * 100.0, "%")
                asked = scaled(one.speed, rate / NORMAL_SPEED)
                if isinstance(asked, Number):
                    speed = f"{max(math.floor(asked.value + _NEAR), 1)}{unit}"
                else:
                    register = self._text.register("SPEED")
                    yield f"  {register}={self._text.text(asked)}"
                    speed = f"{register}{unit}"
            yield f"{'L' if one.straight else 'J'} {place} {speed} FINE"

    def _line_rate(self, one: MoveTo, leg: int) -> tuple[float, str]:
        """Return the speed of a leg at normal speed, and its unit: that of the rotation where the tool point stays.

        The language has one of the two, and the slower one decides.
        """
        known = one.passages
        begin = self._poses(known.q[:, leg - 1] if leg else known.start)
        end = self._poses(known.q[:, leg])
        lengths = np.linalg.norm(end[:, :3, 3] - begin[:, :3, 3], axis=-1)
        turns = np.asarray(angle_between(begin[:, :3, :3], end[:, :3, :3]))
        if lengths.min() <= _NEAR:
            return float(np.degrees(known.turn_speed)), "deg/sec"
        times = np.maximum(lengths / known.speed, turns / known.turn_speed)
        return float((lengths / times).min()) * MILLIMETRES, "mm/sec"

    def _poses(self, q: Array) -> Array:
        """Return the poses (k, 4, 4) of the tool in the world at joint positions (k, n)."""
        return np.asarray(self._code.placed.base @ forward(self._code.placed.arm, q))

    def _joints(self, one: MoveTo, target: Value, leg: int) -> Array:
        """Return the joint positions (n,) at a target: those of the run where it came there, else the nearest ones."""
        goal, text = self._known.value(target), self._text
        if not isinstance(goal, Pose):
            message = "where this MOVE leads is known only while the program runs, and FANUC cannot compute poses"
            text.refuse(message, "write it for each place", "export the run by `--mode plan`", code="E620")
        q = one.passages.q[:, leg]
        if one.passages.reached:
            X = self._poses(q)
            near = np.linalg.norm(X[:, :3, 3] - goal.X[:3, 3], axis=-1) < _NEAR
            there = q[near & (np.asarray(angle_between(X[:, :3, :3], goal.X[:3, :3])) < _NEAR)]
            if len(there) and np.ptp(there, axis=0).max() > _NEAR:
                message = "this MOVE ends in several postures of the arm at one place, and a position has one"
                text.refuse(message, "write it for each of them", code="E620")
            if len(there):
                return np.asarray(there[0])
            if not one.passages.zones[leg]:
                self._unseen.add(self._code.source.place(one.span.start))
        arm = self._code.placed.arm
        solution = inverse(arm, np.linalg.inv(self._code.placed.base) @ goal.X, q[0])
        found = nearest_configurations(solution, q[0])
        if not found:
            text.refuse("the arm does not reach where this MOVE leads, to which the run does not come", code="E620")
        return found[0]

    def _position(self, q: Array) -> str:
        """Return the name of a position with joints (n,), which stands behind the program once."""
        written: list[str] = []
        position(self._code.mapped.joints(q), written)
        _, _, joints = written[0].partition("{")
        positions = self._body.positions
        found = next((i for i, one in enumerate(positions) if one.partition("{")[2] == joints), None)
        return position(self._code.mapped.joints(q), positions) if found is None else f"P[{found + 1}]"


def _is_natural(value: Value) -> bool:
    return isinstance(value, Number) and value.value >= 0 and value.value == round(value.value)
