"""Compile a program, and run it in a cell: each in one call."""

import gc
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path, PurePath

import attrs

from armwright.cell.assembly import assembly_cell, is_assembly
from armwright.cell.hardware import Hardware, HardwareFactory
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.errors import ArmwrightError, ExitStatus, InvalidValueError, KindError, counted, one_of, shown
from armwright.files.inputs import file_below, read_program, regular_file
from armwright.files.limits import limit, limit_message
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.program.bytecode.assembler import assemble
from armwright.program.bytecode.codegen import generate
from armwright.program.bytecode.instructions import Code
from armwright.program.flow_analysis import analysis
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.diagnostic import Diagnostic, sort_diagnostics
from armwright.program.language.names import is_module
from armwright.program.language.source import Source, Span
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.modules.files import ParsedFile, parse_file, read_files
from armwright.program.modules.linking import LinkedProgram, check_module, link
from armwright.program.modules.names import declared_names
from armwright.program.records.layout import LaidOutProgram, RecordType, RecordVariable, lay_out
from armwright.program.records.messages import in_terms_of_records
from armwright.program.semantics import check
from armwright.program.semantics.arguments import Arguments
from armwright.program.semantics.cell_symbols import (
    ImportedFrames,
    ImportedModule,
    KnownCell,
    ReadImport,
    known_cell,
)
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.tree import Program
from armwright.program.vm.interpreter import Progress, interpret
from armwright.program.vm.machine import Limits
from armwright.program.vm.recording import Recording

# Suffix of a file of intermediate code.
CODE_SUFFIX = ".rlc"


@attrs.frozen(kw_only=True)
class Compilation:
    """What became of a text.

    Attributes:
        source: the text, with those of the modules that it imports.
        standard: the language it was read as.
        tokens: its words, without those of modules.
        comments: where its comments stand.
        tree: what it says.
        symbols: the names of the whole.
        imports: what its IMPORTs brought.
        flow: the arms of its statements; None where the syntax is wrong, or where only names were requested.
        diagnostics: what is wrong or odd, in the order of the text.
        code: the intermediate code; None where the program has errors, or where only names were requested.
        cell: the cell that it was compiled for, or the first that it IMPORTs and that has arms, with all frames that
            it imports; None where there is none, or only its names are known.
        cell_symbols: what was known of the cell when the program was checked.
        strict: whether an AFFIX that is only implied is an error.
        laid_out: what it says together with all modules, in which every name stands for one thing, and of records for
            one field; with its records.
        spelling: how the names of the whole are written, by their keys.
        brought: the names that modules give, as this file may write them, with their keys in the whole.
        names: of each file, by its number, its names that have other keys in the whole.
    """

    source: Source
    standard: Standard
    tokens: tuple[Token, ...]
    comments: tuple[Span, ...]
    tree: tree.Program
    symbols: Symbols
    imports: tuple[ImportedFrames, ...]
    flow: Flow | None
    diagnostics: tuple[Diagnostic, ...]
    code: Code | None
    cell: Cell | None = None
    cell_symbols: KnownCell | None = None
    strict: bool = False
    laid_out: LaidOutProgram = attrs.field(
        default=attrs.Factory(lambda self: LaidOutProgram(tree=self.tree), takes_self=True)
    )
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    brought: Mapping[str, str] = attrs.field(factory=dict)
    names: Mapping[int, Mapping[str, str]] = attrs.field(factory=dict)

    @property
    def whole(self) -> Program:
        """What it says together with all modules."""
        return self.laid_out.tree

    @property
    def records(self) -> Mapping[str, Mapping[str, RecordVariable]]:
        """The variables that are records, by key: of the program, under the empty text, and of each procedure."""
        return self.laid_out.variables

    @property
    def record_types(self) -> Mapping[str, RecordType]:
        """Their types, and those that no variable has, by key."""
        return self.laid_out.types


@attrs.frozen(kw_only=True)
class LoadedProgram:
    """The code of a program that was read from a file, with what is needed to run it.

    Attributes:
        code: the intermediate code.
        cell: what it runs in; None where none was specified and none is imported.
        diagnostics: warnings of the compiler.
        imports: the files that the program imports.
        hardware: how the cell is set up to run it.
        is_code_file: whether the file holds intermediate code, and not the text of the program.
        compiled: what became of the text; None where the file holds intermediate code.
    """

    code: Code
    cell: Cell | None
    diagnostics: tuple[Diagnostic, ...] = ()
    imports: tuple[Path, ...] = ()
    hardware: HardwareFactory = kinematic_cell
    is_code_file: bool = False
    compiled: Compilation | None = None


class ProgramError(ArmwrightError, ValueError):
    """A program has errors, and cannot be run.

    Attributes:
        compilation: with all diagnostics.
    """

    exit_status = ExitStatus.PROGRAM_ERRORS

    def __init__(self, compilation: Compilation) -> None:
        """Name the first error, and how many there are."""
        self.compilation = compilation
        errors = [diagnostic for diagnostic in compilation.diagnostics if diagnostic.is_error]
        first, source = errors[0], compilation.source
        more = f" (and {counted(len(errors) - 1, 'more error')})" if len(errors) > 1 else ""
        place = f"{source.name_at(first.span.start)}:{source.line(first.span.start)}"
        super().__init__(f"{place}: {first.code}: {first.message}{more}")


def compile(  # noqa: A001 - what a translator does
    program: str | Path | Source,
    cell: str | Path | Cell | KnownCell | None = None,
    *,
    strict: bool = False,
    std: Standard = Standard.RLO_2,
    read_import: ReadImport | None = None,
    names_only: bool = False,
    arguments: Arguments | None = None,
) -> Compilation:
    """Compile a program.

    Args:
        program: the path of its file, or its text as a ``Source``.
        cell: what the program will act on, or the path of its file; without one, the first that the program IMPORTs
            and that has arms, or else some questions stay open.
        strict: whether an AFFIX that is only implied is an error.
        std: the language: RLO-2, or RLO-83 with nothing more than the report has.
        read_import: how to read what an IMPORT names; of a file, the files beside it unless something else is given;
            of a text, imports stay unknown without it.
        names_only: whether to stop when syntax, names and types have been checked; ``with_flow`` goes on from there.
        arguments: values for constants of the program, in place of their own: numbers, conditions and texts, by name.

    Returns:
        Tree, diagnostics and, where there are no errors, code. A wrong program raises nothing.

    Raises:
        FileFormatError: a file cannot be read, or is not text, or is no cell.
        KindError: an argument is of the wrong kind.
        UnknownNameError: there is no such language, or an argument is for no constant of the program.
        InvalidValueError: an argument is not of the type of its constant.
    """
    if not isinstance(program, str | Path | Source):
        raise KindError(f"program: expected the path of a file or a Source, got {shown(program)}")
    if not (cell is None or isinstance(cell, str | Path | Cell | KnownCell)):
        raise KindError(f"cell: expected a Cell or the path of its file, got {shown(cell)}")
    std = Standard(one_of("language", getattr(std, "value", std), [standard.value for standard in Standard]))
    if isinstance(program, Source):
        source = program
    else:
        path = Path(program)
        source, read_import = Source(path.name, read_program(path)), read_import or import_reader(path.parent)
    model = read_cell(Path(cell)) if isinstance(cell, str | Path) else cell
    with pause_garbage_collection():
        compiled = _check_names(source, model, strict=strict, std=std, read_import=read_import, arguments=arguments)
        return compiled if names_only else _generate_code(analyse_flow(compiled))


def run(
    program: str | Path | Source | Compilation,
    cell: str | Path | Cell | None = None,
    *,
    strict: bool = False,
    std: Standard = Standard.RLO_2,
    hardware: Hardware | HardwareFactory | None = None,
    limits: Limits | None = None,
    progress: Progress | None = None,
    arguments: Arguments | None = None,
) -> Recording:
    """Compile a program and run it in a cell.

    Args:
        program: the path of its file, its text as a ``Source``, or what ``compile`` gave, with the cell of that.
        cell: what it acts on, or the path of its file; without one, the first that it IMPORTs and that has arms.
        strict: whether an AFFIX that is only implied is an error.
        std: the language it is written in.
        hardware: the cell at work, or what makes it of the cell, such as ``armwright.physics.PhysicsCell``; the
            kinematic simulator unless something else is given.
        limits: when the program is taken to run for ever.
        progress: told before each statement: the time on the cell's clock [s] and the line.
        arguments: values for constants of the program, in place of their own.

    Returns:
        All that happened, tick by tick.

    Raises:
        FileFormatError: a file cannot be read, or is not text, or is no cell.
        ProgramError: the program has errors.
        UnknownNameError: an argument is for no constant of the program.
        InvalidValueError: there is no cell; a cell or arguments stand beside a compiled program; or an argument is not
            of the type of its constant.
        KindError: an argument is of the wrong kind.
        RunError: the program could not go on; it has the recording up to there.

    Example:
        ``armwright.program.run("examples/stacking.rlo", "examples/stanford_cell.toml").duration``
    """
    if not (limits is None or isinstance(limits, Limits)):
        raise KindError(f"limits: expected Limits, got {shown(limits)}")
    if isinstance(program, Compilation):
        if cell is not None:
            raise InvalidValueError("cell: a compiled program has its cell; pass the cell to `compile`")
        if arguments:
            raise InvalidValueError("arguments: a compiled program has its constants; pass the arguments to `compile`")
        compiled = program if program.flow is not None else _generate_code(analyse_flow(program))
    else:
        compiled = compile(program, cell, strict=strict, std=std, arguments=arguments)
    if compiled.code is None:
        raise ProgramError(compiled)
    if compiled.cell is None:
        raise InvalidValueError(f"{compiled.source.name} needs a cell to run in, and IMPORTs none")
    at_work = kinematic_cell(compiled.cell) if hardware is None else hardware
    if callable(at_work):
        at_work = at_work(compiled.cell)
    return interpret(compiled.code, compiled.cell, at_work, progress=progress, limits=limits)


def load(
    path: Path,
    cell: Cell | None = None,
    *,
    strict: bool = False,
    std: Standard = Standard.RLO_2,
    arguments: Arguments | None = None,
) -> LoadedProgram:
    """Compile the program in a file, or read a file of intermediate code.

    Args:
        path: of the file; the suffix ``.rlc`` denotes intermediate code.
        cell: what the program acts on; without one, the first that it IMPORTs and that has arms.
        strict: whether an AFFIX that is only implied is an error.
        std: the language that the program is written in.
        arguments: values for constants of the program, in place of their own.

    Raises:
        FileFormatError: the file cannot be read, or is not text.
        UnknownNameError: an argument is for no constant of the program.
        InvalidValueError: an argument is not of the type of its constant, or the file holds intermediate code.
        CodeError: the intermediate code is invalid.
        ProgramError: the program has errors.
    """
    if path.suffix == CODE_SUFFIX:
        if arguments:
            raise InvalidValueError(f"arguments: {path} holds intermediate code, whose constants have their values")
        return LoadedProgram(code=assemble(read_program(path), str(path)), cell=cell, is_code_file=True)
    compiled = compile(path, cell, strict=strict, std=std, arguments=arguments)
    if compiled.code is None:
        raise ProgramError(compiled)
    imports = imported_files(path, compiled)
    return LoadedProgram(
        code=compiled.code,
        cell=compiled.cell,
        diagnostics=compiled.diagnostics,
        imports=imports,
        compiled=compiled,
    )


def imported_files(program: Path, compiled: Compilation) -> tuple[Path, ...]:
    """Return the paths of the files that a program imports."""
    paths = (*(node.path.value for node in compiled.whole.imports), *(one.path for one in compiled.source.modules))
    return tuple(program.parent / path for path in paths)


def read_imported_cell(path: Path) -> Cell:
    """Return what a file that a program IMPORTs has: a cell, or the frames of an assembly.

    Raises:
        MissingExtraError: it is STEP, and cascadio is not installed.
        FileFormatError: the file cannot be read.
    """
    # A program names the file, and it may not name what never ends.
    if is_assembly(path):
        return assembly_cell(regular_file(path), VOCABULARIES[Standard.RLO_2].reserved)
    return read_cell(regular_file(path), arms_needed=False)


def import_reader(folder: Path) -> ReadImport:
    """Return what reads the files that a program of this folder IMPORTs; modules lie in it or below."""

    def read(name: str) -> ImportedFrames | ImportedModule:
        if is_module(name):
            return ImportedModule(text=read_program(file_below(folder, name)))
        cell = read_imported_cell(folder / name)
        return ImportedFrames(frames={frame: node.parent for frame, node in cell.frames.items()}, cell=cell)

    return read


def add_imported_frames(cell: Cell | None, imports: Iterable[ImportedFrames]) -> Cell | None:
    """Return a cell with the frames of imported cells; a frame of the cell itself stays as it is."""
    cells = [imported.cell for imported in imports if imported.cell is not None and imported.cell is not cell]
    if cell is None or not cells:
        return cell
    frames = cell.frames
    for imported in cells:
        frames = {**imported.frames, **frames}
    return attrs.evolve(cell, frames=frames)


@contextmanager
def pause_garbage_collection() -> Iterator[None]:
    """Keep the collector of rings away: a translation makes many small things and few rings, and it looks at them all.

    Of a program of ten thousand lines that is half the time.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            # What has been made is old at once, without being looked at; nothing that somebody else froze is touched.
            if not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def _limit_imports(read_import: ReadImport) -> ReadImport:
    """Return what reads imports, and refuses more files than the limit, or more frames in all of them."""
    frames: dict[str, int] = {}

    def read(name: str) -> ImportedFrames | ImportedModule:
        if name not in frames and len(frames) >= limit("imports"):
            raise InvalidValueError(f"too many files: {limit_message('imports')}")
        frames.setdefault(name, 0)
        brought = read_import(name)
        if isinstance(brought, ImportedModule):
            return brought
        frames[name] = len(brought.frames)
        together = sum(frames.values())
        if together > limit("frames"):
            raise InvalidValueError(f"too many frames in all files together: {limit_message('frames', together)}")
        return brought

    return read


def _imported_cell(program: tree.Program, read_import: ReadImport) -> Cell | None:
    """Return the first cell with arms that a program imports; None without one."""
    for header in program.imports:
        # What cannot be read is told when names are checked.
        with suppress(ArmwrightError):
            brought = read_import(header.path.value)
            if isinstance(brought, ImportedFrames) and brought.cell is not None and brought.cell.arms:
                return brought.cell
    return None


def _check_names(
    source: Source,
    cell: Cell | KnownCell | None,
    *,
    strict: bool,
    std: Standard,
    read_import: ReadImport | None,
    arguments: Arguments | None,
) -> Compilation:
    """Return a program with its syntax, names and types checked."""
    main = parse_file(source, PurePath(source.name).name, std)
    if read_import is not None:
        read_import = cache(_limit_imports(read_import))
    has_modules = std is Standard.RLO_2 and any(is_module(node.path.value) for node in main.tree.imports)
    files = read_files(source, main, read_import) if has_modules else None
    if files is not None:
        source = files.source
    if read_import is not None and cell is None:
        cell = _imported_cell(main.tree, read_import)
    cell_symbols = known_cell(cell) if isinstance(cell, Cell) else cell
    if files is None:
        exported = declared_names(main.tree) if main.tree.module is not None else ()
        linked = LinkedProgram(tree=main.tree, exported=frozenset(exported), diagnostics=check_module(main.tree))
    else:
        linked = link(files, cell_symbols.frames if cell_symbols is not None else ())
    if files is not None and read_import is not None and cell is None and linked.tree.imports:
        # Only a module imports a cell.
        cell = _imported_cell(linked.tree, read_import)
        cell_symbols = known_cell(cell) if cell is not None else None
    laid_out = lay_out(linked.tree)
    symbols, name_errors, imports = check.check(
        laid_out.tree,
        cell_symbols,
        std=std,
        read_import=read_import,
        arguments=arguments,
        exported=linked.exported,
        has_unknown_names=files is not None and files.has_unknown_names,
    )
    diagnostics = [*main.diagnostics, *linked.diagnostics, *laid_out.diagnostics]
    guessed = any(diagnostic.is_syntax for diagnostic in diagnostics)
    # Where the parser had to guess, a name may seem unused.
    diagnostics += [error for error in name_errors if not (guessed and error.code == "L304")]
    return Compilation(
        source=source,
        standard=std,
        tokens=main.tokens,
        comments=main.scanned.comments,
        tree=main.tree,
        laid_out=laid_out,
        brought=linked.brought,
        names=linked.names,
        spelling=_name_spellings((main,) if files is None else files.files.values(), laid_out.tree),
        symbols=symbols,
        imports=imports,
        flow=None,
        diagnostics=sort_diagnostics(in_terms_of_records(diagnostics, laid_out.variables)),
        code=None,
        cell=add_imported_frames(cell, imports) if isinstance(cell, Cell) else None,
        cell_symbols=cell_symbols,
        strict=strict,
    )


def analyse_flow(compiled: Compilation) -> Compilation:
    """Return a program whose names have been checked with its flow analysed, and with all diagnostics.

    Where the parser had to guess, the effect of the statements is unknown, and there is no flow.
    """
    if any(diagnostic.is_syntax for diagnostic in compiled.diagnostics):
        return compiled
    source, cell_symbols, strict = compiled.source, compiled.cell_symbols, compiled.strict
    with pause_garbage_collection():
        flow, diagnostics = analysis.check(
            compiled.whole, compiled.symbols, compiled.spelling, cell_symbols, strict=strict, source=source
        )
    diagnostics = in_terms_of_records(diagnostics, compiled.records)
    return attrs.evolve(compiled, flow=flow, diagnostics=sort_diagnostics((*compiled.diagnostics, *diagnostics)))


def _generate_code(compiled: Compilation) -> Compilation:
    """Return a program with its intermediate code, unless it has errors."""
    if compiled.flow is None or any(diagnostic.is_error for diagnostic in compiled.diagnostics):
        return compiled
    code = generate(compiled.source, compiled.whole, compiled.symbols, compiled.flow, compiled.spelling)
    records = {
        procedure: {key: variable.type.name.text for key, variable in own.items()}
        for procedure, own in compiled.records.items()
    }
    procedures = {
        key: attrs.evolve(procedure, records=records.get(key, {})) for key, procedure in code.procedures.items()
    }
    code = attrs.evolve(
        code,
        standard=compiled.standard,
        procedures=procedures,
        records=records.get("", {}),
        names=compiled.names,
    )
    return attrs.evolve(compiled, code=code)


def _name_spellings(files: Iterable[ParsedFile], whole: Program) -> dict[str, str]:
    """Return how a program first writes each of its names, its own file before those of its modules."""
    tokens = [token for file in files for token in reversed(file.tokens) if token.kind is TokenKind.NAME]
    spelling = {token.key: token.text for token in tokens}
    own = (declaration for node in whole.procedures for declaration in (*node.parameters, *node.declarations))
    names = (*declared_names(whole).values(), *(name for declaration in own for name in declaration.names))
    qualified = (name for name in names if "." in name.key and name.key not in spelling)
    return spelling | {name.key: _spelled(name) for name in qualified}


def _spelled(name: tree.Name) -> str:
    """Return a name with a point in it as a program may write it: a field of a record, or a name of a module."""
    is_field = name.text.count(".") == name.key.count(".")
    return name.text if is_field else f"{name.key.partition('.')[0].lower()}.{name.text}"
