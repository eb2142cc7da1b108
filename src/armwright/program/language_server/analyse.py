"""From a text to all that is known of it."""

from collections.abc import Mapping
from pathlib import Path

import attrs

from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.program.api import Compilation, compile as translate
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.cell_lookup import CellFile, Cells
from armwright.program.semantics.cell_symbols import Imported, known_cell


@attrs.frozen(kw_only=True)
class Settings:
    """How programs are to be read.

    Attributes:
        cell: the cell file; None to look for one.
        std: the language.
        strict: whether an AFFIX that is only implied is an error.
    """

    cell: Path | None = None
    std: Standard = Standard.RLO_2
    strict: bool = False


@attrs.frozen(kw_only=True)
class Analysed:
    """What is known of a text, and why the cell of the settings could not be read; empty if it could."""

    analysis: Analysis
    problem: str = ""


def analyse(name: str, text: str, folder: Path | None, cells: Cells, settings: Settings) -> Analysed:
    """Translate a text in its surroundings.

    Args:
        name: of the program, as shown.
        text: the program.
        folder: where it lies; None where that is nowhere.
        cells: those read so far.
        settings: how it is to be read.
    """
    around = cells.around(folder, text, settings.cell)
    cell = None if around.file is None else around.file.cell
    brought: list[Path] = []

    def read_import(path: str) -> Imported:
        assert folder is not None  # noqa: S101 - it is not asked for otherwise
        imported = cells.imported(folder, path)
        brought.append(folder / path)
        return imported

    compiled = translate(
        Source(name, text),
        None if cell is None else known_cell(cell),
        strict=settings.strict,
        std=settings.std,
        read_import=None if folder is None else read_import,
    )
    files = [cells.read(path) for path in brought]
    if around.file is not None:
        files.append(around.file)
    merged = _whole(cell, compiled)
    analysis = Analysis(compiled=compiled, cell=merged, frames=_frames(merged, around.file), files=_places(files))
    return Analysed(analysis=analysis, problem=around.problem)


def _whole(cell: Cell | None, compiled: Compilation) -> Cell | None:
    """Return a cell with the frames that a program imports; a frame of the cell itself stays as it is."""
    cells = [one.cell for one in compiled.imports if one.cell is not None]
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


def _places(files: list[CellFile]) -> Mapping[str, tuple[str, int]]:
    return {name: (file.path.absolute().as_uri(), line) for file in files for name, line in file.lines.items()}
