"""All that is known of one version of a program, worked out once; and what stands around a position in a text."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path

import attrs
from lsprotocol import types as lsp

from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.errors import FileFormatError
from armwright.program.api import (
    Compilation,
    add_imported_frames,
    analyse_flow,
    compile as compile_program,
    import_reader,
)
from armwright.program.flow_analysis.side_effects import walk_statements
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.names import is_module
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source, Span
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.positions import span_range
from armwright.program.language_server.symbol_index import (
    NameKind,
    Occurrence,
    ScopeExtents,
    occurrences,
    scope_extents,
)
from armwright.program.records.layout import RecordVariable
from armwright.program.semantics.cell_symbols import ImportedFrames, ImportedModule
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind, scan
from armwright.program.syntax.line_numbers import blank_line_numbers

_QUALIFIER = re.compile(r"(?<![\w.])([A-Za-z]\w*)\.(?:[A-Za-z]\w*\.)*\Z")
_LONGEST_QUALIFIER = 100


@attrs.frozen(kw_only=True)
class Settings:
    """The settings with which programs are compiled.

    Attributes:
        cell: the cell file; None to search for one beside the program.
        std: the standard of the language.
        strict: whether an AFFIX that is only implied is an error.
    """

    cell: Path | None = None
    std: Standard = Standard.RLO_2
    strict: bool = False


@attrs.frozen(kw_only=True, slots=False, eq=False)
class Analysis:
    """What is known of a program.

    Attributes:
        compiled: the translation up to its names, which takes half the time of all.
        codec: of its text.
        cell: what it acts on, with what it imports; None where that is not known.
        declaration_lines: where frames and arms are declared, by name: the URI of the file, and the line from 1.
        cell_error: why the cell of the settings cannot be read; empty if it can.
        folder: of the program; None for a text without a file.
    """

    compiled: Compilation
    codec: PositionCodec
    cell: Cell | None = None
    declaration_lines: Mapping[str, tuple[str, int]] = attrs.field(factory=dict)
    cell_error: str = ""
    folder: Path | None = None

    @cached_property
    def complete(self) -> Compilation:
        """The translation with its flow analysed, and with all diagnostics."""
        return analyse_flow(self.compiled)

    @property
    def text(self) -> str:
        """The text of the program."""
        return self.codec.text

    @cached_property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The diagnostics of the program's own file."""
        source = self.compiled.source
        return tuple(one for one in self.complete.diagnostics if not source.file_number(one.span.start))

    @cached_property
    def module_diagnostics(self) -> dict[str, list[Diagnostic]]:
        """The diagnostics of modules, by their paths beside the program."""
        source = self.compiled.source
        found: dict[str, list[Diagnostic]] = {}
        for one in self.complete.diagnostics:
            if file := source.file_number(one.span.start):
                found.setdefault(source.modules[file - 1].path, []).append(one)
        return found

    def location(self, uri: str, span: Span) -> lsp.Location:
        """Return where a span is: in the document with this URI, or in the file of a module."""
        source = self.compiled.source
        file = source.file_number(span.start)
        if not file or self.folder is None:
            return lsp.Location(uri, span_range(self.codec, span))
        codec = PositionCodec(source.file_text(file), self.codec.encoding)
        path = self.folder / source.modules[file - 1].path
        return lsp.Location(path.absolute().as_uri(), span_range(codec, span.moved(-source.modules[file - 1].start)))

    @cached_property
    def frames(self) -> FrameTree | None:
        """The frames of the cell at the start; None without a cell."""
        return None if self.cell is None else self.cell.tree()

    @cached_property
    def scopes(self) -> ScopeExtents:
        """The names that are visible in each range of the text."""
        return scope_extents(self.compiled.symbols, self.compiled.brought)

    @cached_property
    def occurrences(self) -> tuple[Occurrence, ...]:
        """All names, in order."""
        return occurrences(self.compiled.tokens, self.scopes)

    @cached_property
    def hinted_statements(self) -> tuple[tree.Move | tree.Call | tree.Grasp, ...]:
        """The statements that hints are given for, in the order of the text."""
        program = self.compiled.tree
        bodies = (*(procedure.body for procedure in program.procedures), *program.statements)
        hinted = (node for node in walk_statements(bodies) if isinstance(node, tree.Move | tree.Call | tree.Grasp))
        return tuple(sorted(hinted, key=lambda node: node.span.start))

    @cached_property
    def uses_lower_case(self) -> bool:
        """Whether the program writes the words of the language in lower case."""
        first = next((token for token in self.compiled.tokens if token.kind is TokenKind.KEYWORD), None)
        return first is not None and first.text.islower()

    def occurrence_at(self, offset: int) -> Occurrence | None:
        """Return the name at a position, or right in front of it."""
        tokens = self.compiled.tokens
        index = bisect_left(tokens, offset, key=lambda token: token.start)
        # What a name is depends on its own statement alone, and so hover need not wait for the other names.
        first = next((k for k in range(index - 1, 0, -1) if tokens[k].key == ";"), 0)
        last = next((k for k in range(index, len(tokens)) if tokens[k].key == ";"), len(tokens))
        names = occurrences(tokens[first:last], self.scopes)
        return next((name for name in reversed(names) if name.start <= offset <= name.end), None)

    def token_at(self, offset: int) -> Token | None:
        """Return the token that holds a position."""
        token = next(self.tokens_before(offset), None)
        return token if token is not None and offset < token.end else None

    def tokens_before(self, offset: int) -> Iterator[Token]:
        """Give the tokens that start at a position or in front of it, the nearest first."""
        index = bisect_right(self.compiled.tokens, offset, key=lambda token: token.start)
        return reversed(self.compiled.tokens[:index])

    def same_occurrences(self, occurrence: Occurrence) -> tuple[Occurrence, ...]:
        """Return all occurrences of the same thing."""
        return tuple(other for other in self.occurrences if other.refers_to_same(occurrence))

    def record(self, occurrence: Occurrence) -> RecordVariable | None:
        """Return the record that a name stands for as a whole; None where it stands for something else."""
        if occurrence.kind is not NameKind.UNKNOWN:
            return None
        return self.record_named(occurrence.key, occurrence.start)

    def record_named(self, key: str, offset: int) -> RecordVariable | None:
        """Return the record that a name stands for at a position; None where it stands for something else."""
        scope, records = self.scopes.scope_at(offset), self.compiled.records
        local = {} if scope.procedure is None else records.get(scope.procedure.node.name.key, {})
        return local.get(key) or records.get("", {}).get(self.scopes.meant(key, scope))

    def declaration(self, occurrence: Occurrence) -> tree.Name | None:
        """Return where the name was declared, if it was."""
        symbols = self.compiled.symbols
        if (record := self.record(occurrence)) is not None:
            return record.name
        if occurrence.owner is not None:
            return symbols.procedures[occurrence.owner].declared.get(occurrence.key)
        if occurrence.key in symbols.procedures:
            return symbols.procedures[occurrence.key].node.name
        return symbols.declared.get(occurrence.key)


def analyse(name: str, codec: PositionCodec, folder: Path | None, cells: CellCache, settings: Settings) -> Analysis:
    """Analyse the names of a program with its cell and its imports; its flow is analysed when it is asked for.

    Args:
        name: the name of the program, as messages show it.
        codec: of the text of the program.
        folder: the folder of the program; None for a text without a file.
        cells: the cells read so far.
        settings: cell, standard and strictness.
    """
    file, problem = None, ""
    try:
        file = cells.find_cell(folder, codec.text, settings.cell)
    except FileFormatError as error:
        problem = str(error)
    imports: list[Path] = []

    def read_import(path: str) -> ImportedFrames | ImportedModule:
        assert folder is not None  # noqa: S101 - imports are read only with a folder
        if is_module(path):
            return import_reader(folder)(path)
        imported = cells.read_import(folder, path)
        imports.append(folder / path)
        return imported

    compiled = compile_program(
        Source(name, codec.text),
        None if file is None else file.cell,
        strict=settings.strict,
        std=settings.std,
        read_import=None if folder is None else read_import,
        names_only=True,
    )
    files = [*map(cells.read, imports), *([] if file is None else [file])]
    lines = {name: (file.path.absolute().as_uri(), line) for file in files for name, line in file.lines.items()}
    # Where nothing has arms, an imported file still has frames.
    imported = (imported.cell for imported in compiled.imports)
    cell = compiled.cell or add_imported_frames(next(filter(None, imported), None), compiled.imports)
    return Analysis(
        compiled=compiled, codec=codec, cell=cell, declaration_lines=lines, cell_error=problem, folder=folder
    )


@attrs.frozen(kw_only=True)
class LexicalContext:
    """The tokens around a position of a text.

    Attributes:
        preceding: the tokens before the word, in order.
        word: the word that is being written at the position; empty where there is none.
        following: the tokens from the word on.
    """

    preceding: tuple[Token, ...]
    word: Span
    following: tuple[Token, ...]


def lexical_context(text: str, offset: int, std: Standard) -> LexicalContext | None:
    """Return the tokens around a position; None within a comment or a string.

    Args:
        text: the program as it is now, analysed or not.
        offset: the position.
        std: the language.
    """
    start = offset
    while start and (text[start - 1].isalnum() or text[start - 1] in "_-"):
        start -= 1
    # What stands in front of a point names the part of something, unless it is END or a number.
    if (qualifier := _QUALIFIER.search(text[max(0, start - _LONGEST_QUALIFIER) : start])) and std is Standard.RLO_2:
        is_name = qualifier[1].upper() not in VOCABULARIES[std].reserved
        start -= len(qualifier[0]) if is_name else 0
    # A sign in it belongs to an arm or to nothing.
    before_sign, sign, _ = text[start:offset].upper().rpartition("-")
    word = Span(start + len(before_sign + sign) if before_sign != "ARM" else start, offset)
    source = Source("", text)
    scanned = scan(source, blank_line_numbers(source)[0], std)
    if any(comment.start < offset < comment.end + text.startswith("//", comment.start) for comment in scanned.comments):
        return None
    front = tuple(token for token in scanned.tokens if token.end <= word.start and token.kind is not TokenKind.END)
    following = scanned.tokens[len(front) :]
    if following[0].kind is TokenKind.STRING and following[0].start < offset:
        return None
    opened = any(diagnostic.code == "E102" and diagnostic.span.end <= offset for diagnostic in scanned.diagnostics)
    return None if opened else LexicalContext(preceding=front, word=word, following=following)
