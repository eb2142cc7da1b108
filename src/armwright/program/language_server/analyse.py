"""Analysis of a text: it is compiled in its surroundings, with the cell and the imports that belong to it."""

from collections.abc import Mapping
from pathlib import Path

import attrs

from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.program.api import Compilation, compile as compile_program
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.cell_lookup import CellFile, Cells
from armwright.program.semantics.cell_symbols import Imported, known_cell


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


@attrs.frozen(kw_only=True)
class Analysed:
    """The analysis of a text.

    Attributes:
        analysis: the analysis.
        problem: why the cell of the settings cannot be read; empty if it can.
    """

    analysis: Analysis
    problem: str = ""


def analyse(name: str, text: str, folder: Path | None, cells: Cells, settings: Settings) -> Analysed:
    """Analyse a program with its cell and its imports; intermediate code is not generated.

    Args:
        name: the name of the program, as messages show it.
        text: the text of the program.
        folder: the folder of the program; None for a text without a file.
        cells: the cells read so far.
        settings: cell, standard and strictness.
    """
    around = cells.around(folder, text, settings.cell)
    cell = None if around.file is None else around.file.cell
    imports: list[Path] = []

    def read_import(path: str) -> Imported:
        assert folder is not None  # noqa: S101 - imports are read only with a folder
        imported = cells.imported(folder, path)
        imports.append(folder / path)
        return imported

    compiled = compile_program(
        Source(name, text),
        None if cell is None else known_cell(cell),
        strict=settings.strict,
        std=settings.std,
        read_import=None if folder is None else read_import,
        generate_code=False,
    )
    files = [cells.read(path) for path in imports]
    if around.file is not None:
        files.append(around.file)
    merged = _with_imports(cell, compiled)
    analysis = Analysis(compiled=compiled, cell=merged, frames=_frames(merged, around.file), files=_declarations(files))
    return Analysed(analysis=analysis, problem=around.problem)


def _with_imports(cell: Cell | None, compiled: Compilation) -> Cell | None:
    """Return a cell with the frames that a program imports; a frame of the cell itself stays as it is."""
    cells = [imported.cell for imported in compiled.imports if imported.cell is not None]
    if cell is None:
        cell, cells = (cells[0], cells[1:]) if cells else (None, [])
    if cell is None or not cells:
        return cell
    frames = dict(cell.frames)
    for imported in cells:
        frames = {**imported.frames, **frames}
    return attrs.evolve(cell, frames=frames)


def _frames(cell: Cell | None, file: CellFile | None) -> FrameTree | None:
    if cell is None:
        return None
    return file.frames if file is not None and file.cell is cell else cell.tree()


def _declarations(files: list[CellFile]) -> Mapping[str, tuple[str, int]]:
    return {name: (file.path.absolute().as_uri(), line) for file in files for name, line in file.lines.items()}
