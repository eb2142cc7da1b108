"""Line numbers of editors: a listing may carry them, nothing refers to them, and they are taken off here."""

import re

from armwright.program.language.diagnostic import Diagnostic, DiagnosticList
from armwright.program.language.source import Source, Span

_NUMBER = re.compile(r"[ \t]*([0-9]+)(?=[ \t\r\n]|\Z)")
_CONTENT = re.compile(r"[ \t]*([^ \t\r\n])")
# Digits before one of these belong to the program: a matrix continued from the line above.
_CONTINUED = re.compile(r"[ \t]*[,;)]")


def blank_line_numbers(source: Source) -> tuple[str, list[Diagnostic]]:
    """Return the text with every line number blanked out, and what is odd about the numbers.

    A text is numbered when its first line that is not blank starts with digits and a blank. Blanks take the place
    of the digits, so that every other character stays where it was.
    """
    text = source.text.replace("\ufeff", " ", 1) if source.text.startswith("\ufeff") else source.text
    first = re.search(r"\S", text)
    if not first or not _NUMBER.match(text, first.start()):
        return text, []
    pieces: list[str] = []
    odd = DiagnosticList()
    done, last, last_span, numbered = 0, -1, Span(0, 0), True
    for start in source.line_starts:
        match = _NUMBER.match(text, start)
        if match and not _CONTINUED.match(text, match.end()):
            span = Span(*match.span(1))
            number = int(match[1][-18:])
            if number <= last:
                message = f"line number {source.slice(span)} comes after {source.slice(last_span)}"
                note = "line numbers have no meaning in RLO; statements run in the order of the text"
                odd.report("W101", message, span, "expected a larger number", note=note)
            last, last_span = number, span
            pieces += [text[done : span.start], " " * (span.end - span.start)]
            done, numbered = span.end, True
        elif content := _CONTENT.match(text, start):
            # One word on a run of lines is enough.
            if numbered:
                here = Span(content.start(1), content.start(1))
                odd.report("W101", "this line has no line number, but the others have", here, "expected a number here")
            numbered = False
    return "".join((*pieces, text[done:])), odd
