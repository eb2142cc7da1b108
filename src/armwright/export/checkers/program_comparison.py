"""What a machine has done when it ran an exported program, beside the run of the program in its cell."""

from collections.abc import Iterator

import numpy as np

from armwright.arrays import Array
from armwright.export.checkers.actions import (
    Action,
    JointAction,
    LineAction,
    PulseAction,
    ReadProgram,
    TextAction,
    WaitAction,
)
from armwright.export.checkers.comparison import Comparing
from armwright.export.proof import Comparison
from armwright.export.statements import ControllerProgram, PulseOutput, Statement
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import allowed_configurations
from armwright.motion.plan import StageGoal

# By so much the passages of one stage may differ in time, and waits that are worked out [s].
_SAME_TIME = 2e-3
# Numbers in texts may differ by this part.
_DIGITS = 1e-4


def compare_run(read: ReadProgram, program: ControllerProgram) -> tuple[Comparison, ...]:
    """Return how what a machine has done differs from what the program did in its cell.

    Args:
        read: what the machine of the target has done.
        program: what the program did.
    """
    return _ComparingRun(program).run(read)


class _ComparingRun(Comparing):
    """A program that a machine has run, beside the run in the cell."""

    def __init__(self, program: ControllerProgram) -> None:
        super().__init__(program)
        self._wrong: dict[int, int] = {}

    def _statement(self, statement: Statement, actions: Iterator[Action]) -> None:
        if not isinstance(statement, PulseOutput):
            super()._statement(statement, actions)
            return
        pulse = next(actions, None)
        right = (
            isinstance(pulse, PulseAction)
            and pulse.output in (statement.output.number, statement.output.signal)
            and abs(pulse.seconds - statement.seconds) <= _SAME_TIME
        )
        self.statements.add(0 if right else 1, 0 if pulse is None else pulse.line)

    def _target(self, action: JointAction, q: Array, duration: float) -> None:
        before = self._q
        if action.X is None:
            self._joints(action, q)
        else:
            self._reached(action, action.X, q)
            self._q = np.array(q)
        way = np.abs(self._q - before)
        if action.duration is not None:
            self._duration(action.duration, duration, action)
            self.speeds.add(float((way / max(action.duration, 1e-9) / self._model.limits).max()), action.line)
        elif action.joint_speed is not None and way.max() > 0:
            self.speeds.add(float((way / way.max() * action.joint_speed / self._model.limits).max()), action.line)
        elif action.speed_part is not None:
            self.speeds.add(action.speed_part, action.line)
        self.statements.add(int(action.passes), action.line)

    def _reached(self, action: JointAction, target: Array, q: Array) -> None:
        """Compare the pose of a target, and which of the configurations there the controller takes."""
        X = np.asarray(self._program.mapped.X_BC @ target)
        self._poses(X, self._model.pose(q[None])[0], action.line)
        if action.configuration:
            words = self._postures.words(self._program.mapped.joints(q))
            wrong = sum(value not in words[word] for word, value in action.configuration.items())
            self.postures.add(wrong, action.line)
        near = self._q if action.near is None else self._model.joints(action.near)
        found = [one.q for one in allowed_configurations(inverse(self._program.mapped.arm, X, near))]
        found = [one for one in found if self._has_words(one, action)]
        nearest = min(found, key=lambda one: float(((one - near) ** 2).sum()), default=near)
        self.joints.add(float(np.abs(nearest - q).max()), action.line)

    def _has_words(self, q: Array, action: JointAction) -> bool:
        words = self._postures.words(self._program.mapped.joints(q))
        here = self._postures.words(self._program.mapped.joints(self._q)) if action.kept else {}
        asked = all(value in words[word] for word, value in action.configuration.items())
        return asked and all(words[word] & here[word] for word in action.kept)

    def _duration(self, found: float, planned: float, action: JointAction | LineAction | WaitAction) -> None:
        # A run waits for a whole number of servo periods.
        if isinstance(action, WaitAction) or planned:
            self.times.add(max(abs(found - planned) - action.rounding - _SAME_TIME, 0.0), action.line)

    def _configuration(self, action: LineAction) -> None:
        """Take note of wrong words: on lines controllers do not need them, and those of one pass are enough.

        A corner that is rounded is not reached, and the words are those of the path beside it.
        """
        if action.configuration and not action.zone:
            words = self._postures.words(self._program.mapped.joints(self._q))
            wrong = sum(value not in words[word] for word, value in action.configuration.items())
            self._wrong[action.line] = min(wrong, self._wrong.get(action.line, wrong))

    def _end_of_program(self) -> None:
        for line, wrong in self._wrong.items():
            self.postures.add(wrong, line)

    def _width(self, goal: StageGoal) -> float | Array | None:
        return goal.blend if goal.blend is not None else goal.corner

    def _text(self, text: str, actions: Iterator[Action]) -> None:
        """Compare a text, of which numbers may have other digits, in lines that are not too long."""
        shown, line = "", 0
        while not line or _is_short(shown, text):
            action = next(actions, None)
            if not isinstance(action, TextAction):
                self.statements.add(1, line)
                return
            shown, line = shown + action.text, action.line
        one, other = shown.split(), text.split()
        alike = len(one) == len(other) and all(_same_word(a, b) for a, b in zip(one, other, strict=True))
        self.statements.add(0 if alike else 1, line)


def _is_short(shown: str, text: str) -> bool:
    """Whether another line is to follow, as words are missing, or a part of the last one."""
    words, wanted = shown.split(), text.split()
    cut = bool(words) and len(words) == len(wanted) and len(shown) < len(text) and not _same_word(words[-1], wanted[-1])
    return len(words) < len(wanted) or (cut and wanted[-1].startswith(words[-1]))


def _same_word(shown: str, word: str) -> bool:
    try:
        return abs(float(shown) - float(word)) <= _DIGITS * max(abs(float(word)), 1e-3)
    except ValueError:
        alike = (a == b or a in "?'" for a, b in zip(shown, word, strict=True))
        return shown.lower() == word.lower() or (len(shown) == len(word) and all(alike))
