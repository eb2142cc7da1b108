"""The files of a program: its own, and the modules that it imports, each read and parsed once."""

from pathlib import PurePosixPath

import attrs

from armwright.errors import ArmwrightError
from armwright.files.limits import MEGABYTE, limit, limit_message
from armwright.program.language.diagnostic import Diagnostic, DiagnosticList
from armwright.program.language.names import is_module
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import ImportedModule, ReadImport
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import ScannedText, Token, scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse


@attrs.frozen(kw_only=True)
class ParsedFile:
    """A file with its tree, whose spans count from the start of the program's text.

    Attributes:
        path: relative to the folder of the program, with ``/``; of the program itself the name of its file.
        scanned: its tokens and comments.
        tree: what it says.
        diagnostics: what is wrong with its syntax.
    """

    path: str
    scanned: ScannedText
    tree: tree.Program
    diagnostics: tuple[Diagnostic, ...]

    @property
    def tokens(self) -> tuple[Token, ...]:
        """Its tokens."""
        return self.scanned.tokens


@attrs.frozen(kw_only=True)
class ImportedFile:
    """An IMPORT of a module, and the file that it names.

    Attributes:
        node: the IMPORT.
        path: of the file.
    """

    node: tree.Import
    path: str


@attrs.frozen(kw_only=True)
class ProgramFiles:
    """All files of a program.

    Attributes:
        source: their texts.
        files: by path, each behind those that it imports, so that the program itself is the last.
        imports: by the path of a file, the modules that it imports.
        diagnostics: modules that cannot be read, and rings of imports.
        has_unknown_names: whether there are any, so that an unknown name may be one of theirs.
    """

    source: Source
    files: dict[str, ParsedFile]
    imports: dict[str, list[ImportedFile]]
    diagnostics: DiagnosticList
    has_unknown_names: bool

    @property
    def main(self) -> ParsedFile:
        """The program's own file."""
        return next(reversed(self.files.values()))


def parse_file(source: Source, path: str, std: Standard = Standard.RLO_2) -> ParsedFile:
    """Scan and parse the last file of a program."""
    start = source.modules[-1].start if source.modules else 0
    text, odd = blank_line_numbers(Source(path, source.text[start:]) if start else source)
    moved = [attrs.evolve(one, span=one.span.moved(start)) for one in odd] if start else odd
    scanned = scan(source, " " * start + text, std, start)
    program, syntax_errors = parse(source, scanned.tokens, std)
    return ParsedFile(
        path=path, scanned=scanned, tree=program, diagnostics=(*moved, *scanned.diagnostics, *syntax_errors)
    )


def read_files(source: Source, main: ParsedFile, read_import: ReadImport | None) -> ProgramFiles:
    """Read the modules that a program imports, and those that they import.

    Args:
        source: the text of the program's own file.
        main: the same, parsed.
        read_import: gives the text of a module; None where nothing can be read.
    """
    reader = _Reader(source, read_import)
    reader.visit(main)
    return ProgramFiles(
        source=reader.source,
        files=reader.files,
        imports=reader.imports,
        diagnostics=reader.diagnostics,
        has_unknown_names=reader.has_unknown_names,
    )


class _Reader:
    """One walk from file to file."""

    def __init__(self, source: Source, read_import: ReadImport | None) -> None:
        self.source, self._read_import = source, read_import
        self.files: dict[str, ParsedFile] = {}
        self.imports: dict[str, list[ImportedFile]] = {}
        self.diagnostics = DiagnosticList()
        self.has_unknown_names = False
        # The files between the program and the one that is being read.
        self._open: list[str] = []

    def visit(self, file: ParsedFile) -> None:
        """Take up a file behind the modules that it imports."""
        self._open.append(file.path)
        modules = (node for node in file.tree.imports if is_module(node.path.value))
        self.imports[file.path] = [
            ImportedFile(node=node, path=path) for node in modules if (path := self._read(file.path, node)) is not None
        ]
        self._open.pop()
        self.files[file.path] = file

    def _read(self, importer: str, node: tree.Import) -> str | None:
        """Read a module, unless that was done before; return its path, or None where that was reported."""
        written = PurePosixPath(node.path.value)
        if written.is_absolute() or ".." in written.parts or "\\" in node.path.value:
            self._refuse(node, "a module lies in the folder of the file that imports it, or below that")
            return None
        path = beside(importer, node.path.value)
        if path in self._open:
            ring = " -> ".join((*self._open[self._open.index(path) :], path))
            text, note = f"`{node.path.value}` imports this file again", f"the ring is {ring}"
            advice = "put what both need into a module of its own, and import that"
            self.diagnostics.report("E251", text, node.path.span, "a ring of imports", note=note, advice=advice)
            self.has_unknown_names = True
            return None
        if path in self.files:
            return path
        module = self._module_text(node, path)
        if module is None:
            return None
        self.source = self.source.with_module(path, module)
        self.visit(parse_file(self.source, path))
        return path

    def _module_text(self, node: tree.Import, path: str) -> str | None:
        """Return the text of a module; None where it was reported that there is none."""
        why = "a text without a file has no folder where it could lie"
        if self._read_import is not None:
            try:
                brought = self._read_import(path)
                assert isinstance(brought, ImportedModule)  # noqa: S101 - its path is that of a module
                if len(self.source.text) + len(brought.text) <= limit("program_mb") * MEGABYTE:
                    return brought.text
                why = f"all files together are too long: {limit_message('program_mb')}"
            except ArmwrightError as error:
                why = str(error)
        self._refuse(node, why)
        return None

    def _refuse(self, node: tree.Import, note: str) -> None:
        self.has_unknown_names = True
        text = f"`{node.path.value}` cannot be imported"
        self.diagnostics.report("E228", text, node.path.span, "not read", note=note)


def beside(importer: str, name: str) -> str:
    """Return the path of a file that another names, as seen from the folder of the program."""
    return str(PurePosixPath(importer).parent / name)
