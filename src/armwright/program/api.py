"""The whole way from a text to code, in one call."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache

import attrs

from armwright.errors import ArmwrightError, InvalidValueError
from armwright.files.limits import beyond, limit
from armwright.program.bytecode.codegen import generate
from armwright.program.bytecode.instructions import Code
from armwright.program.flow_analysis import analysis
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.diagnostic import Diagnostic, in_order
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.semantics import check
from armwright.program.semantics.cell_symbols import Imported, KnownCell, ReadImport, known_cell
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind, scan
from armwright.program.syntax.line_numbers import without_numbers
from armwright.program.syntax.parser import parse


@attrs.frozen(kw_only=True)
class Compilation:
    """What became of a text.

    Attributes:
        source: the text.
        standard: the language it was read as.
        tokens: its words.
        comments: where its comments stand.
        tree: what it says.
        symbols: its names.
        imports: what its IMPORTs brought.
        flow: the arms of its statements; None where the syntax is wrong.
        diagnostics: what is wrong or odd, in the order of the text.
        code: what it does; None when there are errors.
    """

    source: Source
    standard: Standard
    tokens: tuple[Token, ...]
    comments: tuple[Span, ...]
    tree: tree.Program
    symbols: Symbols
    imports: tuple[Imported, ...]
    flow: Flow | None
    diagnostics: tuple[Diagnostic, ...]
    code: Code | None


def compile(  # noqa: A001 - what a translator does
    source: Source,
    cell: KnownCell | None = None,
    *,
    strict: bool = False,
    std: Standard = Standard.RLO_2,
    read_import: ReadImport | None = None,
) -> Compilation:
    """Translate a program.

    Args:
        source: the text.
        cell: what the program will act on; without one, the first that it IMPORTs and that has arms, or else some
            questions stay open.
        strict: whether an AFFIX that is only implied is an error.
        std: the language: RLO-2, or RLO-83 with nothing more than the report has.
        read_import: how to read what an IMPORT names; without it, imports stay unknown.

    Returns:
        Tree, diagnostics and, where there are no errors, code. A wrong program raises nothing.
    """
    with no_collection():
        return _compile(source, cell, strict=strict, std=std, read_import=read_import)


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep the collector of rings away: a translation makes many small things and few rings, and it looks at them all.

    Of a program of ten thousand lines that is half the time.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _bounded(read_import: ReadImport) -> ReadImport:
    """Return what reads imports, and refuses more files than the limit, or more frames in all of them."""
    frames: dict[str, int] = {}

    def read(name: str) -> Imported:
        if name not in frames and len(frames) >= limit("imports"):
            raise InvalidValueError(f"too many files: {beyond('imports')}")
        frames.setdefault(name, 0)
        brought = read_import(name)
        frames[name] = len(brought.frames)
        together = sum(frames.values())
        if together > limit("frames"):
            raise InvalidValueError(f"too many frames in all files together: {beyond('frames', together)}")
        return brought

    return read


def _imported(program: tree.Program, read_import: ReadImport) -> KnownCell | None:
    """Return the first cell with arms that a program imports; None without one."""
    for header in program.headers:
        if isinstance(header, tree.Import):
            # What cannot be read is told when names are checked.
            with suppress(ArmwrightError):
                cell = read_import(header.path.value).cell
                if cell is not None and cell.arms:
                    return known_cell(cell)
    return None


def _compile(
    source: Source, cell: KnownCell | None, *, strict: bool, std: Standard, read_import: ReadImport | None
) -> Compilation:
    text, found = without_numbers(source)
    scanned = scan(source, text, std)
    program, slips = parse(source, scanned.tokens, std)
    if read_import is not None:
        read_import = cache(_bounded(read_import))
        cell = _imported(program, read_import) if cell is None else cell
    symbols, wrong, imports = check.check(program, cell, std=std, read_import=read_import)
    spelling = {token.key: token.text for token in reversed(scanned.tokens) if token.kind is TokenKind.NAME}
    found += [*scanned.found, *slips]
    guessed = any(one.is_syntax for one in found)
    # Where the parser had to guess, a name may seem unused, and what the statements do cannot be told.
    found += [one for one in wrong if not (guessed and one.code == "L304")]
    code = course = None
    if not guessed:
        course, odd_course = analysis.check(program, symbols, spelling, cell, strict=strict, source=source)
        found += odd_course
        if not any(one.is_error for one in found):
            code = attrs.evolve(generate(source, program, symbols, course, spelling), standard=std)
    return Compilation(
        source=source,
        standard=std,
        tokens=tuple(scanned.tokens),
        comments=tuple(scanned.comments),
        tree=program,
        symbols=symbols,
        imports=imports,
        flow=course,
        diagnostics=in_order(found),
        code=code,
    )
