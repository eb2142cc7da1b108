"""The formatter: programs of the same tokens are formatted alike."""

from armwright.errors import ExitStatus, InvalidValueError
from armwright.program.api import pause_garbage_collection
from armwright.program.formatter.layout import rows_of
from armwright.program.formatter.line_breaks import lines_of
from armwright.program.formatter.pieces import pieces_of
from armwright.program.formatter.whitespace import set_blanks
from armwright.program.language.diagnostic import Diagnostic, sort_diagnostics
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.syntax.lexer import scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse

# How long a line may be, in characters.
WIDTH = 80
# Of what the parser reports, this leaves the program as it was written: names that are too long, types that do not
# exist, a MODULE in another place.
_UNDERSTOOD = ("E103", "E205", "E250")
# Digits in front of one of these are no line number.
_NOT_NUMBERED = (",", ";", ")")


class UnformattableError(InvalidValueError):
    """A program cannot be formatted, because its syntax is wrong.

    Attributes:
        source: the program.
        first: the first error.
    """

    exit_status = ExitStatus.PROGRAM_ERRORS

    def __init__(self, source: Source, first: Diagnostic) -> None:
        """State the first error and its position."""
        self.source, self.first = source, first
        line, column = source.line(first.span.start), source.column(first.span.start)
        super().__init__(f"{source.name}:{line}:{column}: cannot be formatted: {first.message} ({first.code})")


def formatted(source: Source, *, std: Standard = Standard.RLO_2, numbers: int | None = None, width: int = WIDTH) -> str:
    """Return a program formatted.

    Words of the language are in upper case, names spelt as they are declared, arms ``ARM_1``; each statement has a
    line of its own, and each clause of a MOVE that is longer than a line. Comments, blank lines (one in a row),
    parentheses and the spelling of numbers stay, and so does the last ``;`` in front of END, there or not.

    Args:
        source: the program. Line ends of any kind become line feeds.
        std: its language.
        numbers: how far the numbers of lines are apart; without it, lines have no numbers.
        width: how long a line may be [characters], if it can be broken somewhere.

    Raises:
        UnformattableError: the syntax is wrong; the text states the first error.
        InvalidValueError: ``numbers`` or ``width`` is below 1.
    """
    for what, value in (("numbers", numbers), ("width", width)):
        if value is not None and value < 1:
            raise InvalidValueError(f"{what}: expected 1 or more, got {value}")
    with pause_garbage_collection():
        lines = _lines(Source(source.name, source.text.replace("\r\n", "\n").replace("\r", "\n")), std, width)
    return "\n".join((*(_numbered(lines, numbers) if numbers else lines), ""))


def _lines(source: Source, std: Standard, width: int) -> list[str]:
    text, _ = blank_line_numbers(source)
    scanned = scan(source, text, std)
    program, diagnostics = parse(source, scanned.tokens, std)
    errors = sort_diagnostics(
        diagnostic
        for diagnostic in (*scanned.diagnostics, *diagnostics)
        if diagnostic.is_error and diagnostic.code not in _UNDERSTOOD
    )
    if errors:
        raise UnformattableError(source, errors[0])
    pieces = pieces_of(text, scanned, program)
    set_blanks(pieces)
    return lines_of(rows_of(program, pieces, width), width)


def _numbered(lines: list[str], step: int) -> list[str]:
    """Put a number in front of each line."""
    field = len(str(step * len(lines))) + 2
    return [
        ((" " * field if line.lstrip().startswith(_NOT_NUMBERED) else f"{step * number}".ljust(field)) + line).rstrip()
        for number, line in enumerate(lines, 1)
    ]
