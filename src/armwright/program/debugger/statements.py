"""The statements of a program as its code knows them: where each begins, and in which line a run can be stopped."""

from bisect import bisect_right
from collections.abc import Iterator

import attrs

from armwright.program.bytecode.instructions import Code, Op
from armwright.program.language.source import Span

# What stands behind the last statement of a part, though it belongs to a statement around it.
_TRAILING = frozenset((Op.JMP, Op.ENDT, Op.ENDR, Op.UNLK, Op.RET, Op.QUIT, Op.DISARM))


@attrs.frozen(kw_only=True)
class StatementStart:
    """Where a statement begins.

    Attributes:
        index: of its first instruction.
        span: in the text; of a statement that holds others only its head.
        line: from 1, in its file.
        file: which file it stands in, as ``Source.file_number`` counts them.
    """

    index: int
    span: Span
    line: int
    file: int = 0


class Statements:
    """The statements of a program."""

    def __init__(self, code: Code) -> None:
        """Check every instruction once."""
        self._code = code
        self._start_indices = [index for index, step in enumerate(code.instructions) if step.begins]
        self._procedures = sorted((procedure.start, name) for name, procedure in code.procedures.items())
        starts = tuple(self._find_starts())
        self._by_index = {start.index: start for start in starts}
        # A line is entered by the first statement in it; a FOR has a second beginning for each further pass.
        self._by_position = sorted(starts, key=lambda start: (start.file, start.line, start.span.start, start.index))

    def statement_at(self, index: int) -> StatementStart:
        """Return the statement that an instruction belongs to; behind the last one, the last."""
        index = min(index, len(self._code.instructions) - 1)
        number = bisect_right(self._start_indices, index) - 1
        start = self._by_index[self._start_indices[max(number, 0)]]
        step = self._code.instructions[index]
        if step.op in _TRAILING and not step.begins:
            file = self._code.source.file_number(step.span.start)
            return StatementStart(index=index, span=step.span, line=self._code.line(step), file=file)
        return start

    def procedure_at(self, index: int) -> str | None:
        """Return the procedure that an instruction stands in; None for the main program."""
        number = bisect_right(self._procedures, index, key=lambda procedure: procedure[0]) - 1
        return self._procedures[number][1] if number >= 0 else None

    def find(self, line: int, column: int | None = None, file: int = 0) -> StatementStart | None:
        """Return the statement at which a run can be stopped for a line.

        Args:
            line: from 1.
            column: from 1; the statement that begins there or is the next in this line.
            file: of the line, as ``Source.file_number`` counts them.

        Returns:
            The first statement that begins in the line, or in the next line in which one does; None where no
            statement follows.
        """
        source = self._code.source
        for start in self._by_position:
            early = column is not None and start.line == line and source.column(start.span.start) < column
            if start.file == file and start.line >= line and not early:
                return start
        return None

    def in_lines(self, first: int, last: int, file: int = 0) -> Iterator[StatementStart]:
        """Give the statements that begin in some lines of a file, in the order of the text, each once."""
        lines = set()
        for start in self._by_position:
            if start.file == file and first <= start.line <= last and start.span.start not in lines:
                lines.add(start.span.start)
                yield start

    def _find_starts(self) -> Iterator[StatementStart]:
        instructions, source = self._code.instructions, self._code.source
        ends = [*self._start_indices[1:], len(instructions)]
        for first, end in zip(self._start_indices, ends, strict=True):
            group = instructions[first:end]
            instructions_of_statement = [group[0], *(step for step in group[1:] if step.op not in _TRAILING)]
            index = min(step.span.start for step in instructions_of_statement)
            # A condition or an action of a MOVE lies inside of its statement, and never begins before it.
            span = Span(index, max(step.span.end for step in instructions_of_statement if step.span.start == index))
            yield StatementStart(index=first, span=span, line=source.line(index), file=source.file_number(index))
