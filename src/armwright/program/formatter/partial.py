"""Formatting of a program with errors of syntax: the statements around them are formatted, no token is changed."""

from collections.abc import Iterator

from armwright.program.formatter.format import WIDTH, UnformattableError, formatted
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import TokenKind, scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse

# Comments around statements that are formatted by themselves; no program has them.
_FROM, _TO = "//<<armwright", "//armwright>>"


def formatted_around(source: Source, *, std: Standard = Standard.RLO_2, width: int = WIDTH) -> str:
    """Return a program formatted as far as its syntax is right.

    A program without errors is formatted whole. Of any other the statements of the main program are formatted that
    contain no error and share no line with one that does; everything else stays as it is. Tokens, their order and
    comments are the same afterwards.

    Args:
        source: the program.
        std: its language.
        width: how long a line may be [characters].

    Raises:
        UnformattableError: nothing of it can be formatted; the text states the first error.
    """
    try:
        return formatted(source, std=std, width=width)
    except UnformattableError:
        unix = Source(source.name, source.text.replace("\r\n", "\n").replace("\r", "\n"))
        after = _around(unix, std, width)
        if after is None or _words(unix.text, std) != _words(after, std):
            raise
        return after


def _around(source: Source, std: Standard, width: int) -> str | None:
    """Return the text with its correct statements formatted; None where there are none."""
    text, _ = blank_line_numbers(source)
    if text != source.text:
        # Numbers of lines would no longer be in order.
        return None
    scanned = scan(source, text, std)
    program, diagnostics = parse(source, scanned.tokens, std)
    errors = [diagnostic.span for diagnostic in (*scanned.diagnostics, *diagnostics) if diagnostic.is_error]
    begin = next((token for token in scanned.tokens if token.key == "BEGIN" and _is_main(token.start, program)), None)
    end = next((token for token in reversed(scanned.tokens) if token.key == "END"), None)
    if begin is None or end is None or not program.statements or end.start < program.statements[-1].span.end:
        return None
    head = source.text[: begin.start]
    head_has_error = any(diagnostic.start <= begin.end for diagnostic in errors)
    pieces, done, is_formatted = [], 0, False
    for span in _correct_spans(source, program, Span(begin.end, end.start), errors):
        formatted_text = _formatted_alone("" if head_has_error else head, source.slice(span), std, width)
        if formatted_text is not None and formatted_text != source.slice(span):
            pieces += [source.text[done : span.start], formatted_text]
            done = span.end
        is_formatted = is_formatted or formatted_text is not None
    return "".join((*pieces, source.text[done:])) if is_formatted else None


def _is_main(start: int, program: tree.Program) -> bool:
    """Whether a BEGIN is that of the main program: it stands behind all headers and in front of all statements."""
    behind = max((header.span.end for header in program.headers), default=0)
    return start >= behind and (not program.statements or start < program.statements[0].span.start)


def _correct_spans(source: Source, program: tree.Program, body: Span, errors: list[Span]) -> Iterator[Span]:
    """Yield spans of whole lines with statements of the main program that contain no error."""
    starts = [statement.span.start for statement in program.statements]
    ends = [*starts[1:], body.end]
    first, last = -1, body.start
    for statement, start, end in zip(program.statements, starts, ends, strict=True):
        line, next_line = (source.text.rfind("\n", 0, index) + 1 for index in (start, end))
        has_error = any(diagnostic.start <= end and diagnostic.end >= start for diagnostic in errors)
        if isinstance(statement, tree.Poison) or has_error:
            if last > first >= 0:
                yield Span(first, last)
            first = -1
            continue
        if first < 0 and line >= body.start and not source.text[line:start].strip():
            first = last = line
        # Where the next statement shares a line with this one, both are formatted, or neither.
        if first >= 0 and next_line > start and not source.text[next_line:end].strip():
            last = next_line
    if last > first >= 0:
        yield Span(first, last)


def _formatted_alone(head: str, statements: str, std: Standard, width: int) -> str | None:
    """Return statements formatted as those of a program of their own; None where that has errors."""
    program = f"{head}BEGIN\n{_FROM}\n{statements}{_TO}\nEND.\n"
    try:
        lines = formatted(Source("", program), std=std, width=width).split("\n")
    except UnformattableError:
        return None
    marks = [index for index, line in enumerate(lines) if line.strip() in (_FROM, _TO)]
    if len(marks) != 2:
        return None
    formatted_text = "\n".join((*lines[marks[0] + 1 : marks[1]], ""))
    return formatted_text if _words(formatted_text, std) == _words(statements, std) else None


def _words(text: str, std: Standard) -> tuple[list[tuple[TokenKind, str]], list[list[str]]]:
    """Return what must stay as it is: words and signs but for needless `;`, and the words of comments."""
    scanned = scan(Source("", text), text, std)
    words = [(token.kind, token.key) for token in scanned.tokens if token.key != ";"]
    return words, [text[span.start : span.end].split() for span in scanned.comments]
