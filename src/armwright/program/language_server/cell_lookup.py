"""The cell that a program in an editor is meant for: named in a setting, imported, or the only one beside it."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

import attrs

from armwright.cell.assembly import is_assembly
from armwright.cell.model import Cell
from armwright.errors import ArmwrightError, FileFormatError
from armwright.files.document import Document
from armwright.program.api import read_imported_cell
from armwright.program.semantics.cell_symbols import ImportedFrames

_IMPORT = re.compile(r'\bIMPORT\s*"([^"\r\n]*)"', re.IGNORECASE)
_ARM = re.compile(r"\AARM[-_]0*([0-9]+)\Z", re.IGNORECASE)
# A folder with more files that might be cells, or a larger one, is no folder of cells.
_MAX_FILES = 50
_LARGEST_FILE = 1_000_000
_SUFFIXES = (".toml", ".json")


@attrs.frozen(kw_only=True)
class CellFile:
    """A cell as its file tells it.

    Attributes:
        path: the file.
        cell: what it says.
        lines: of frames and arms, from 1, by name.
    """

    path: Path
    cell: Cell
    lines: Mapping[str, int]


class CellCache:
    """Cell files that have been read; one that has changed since is read again."""

    def __init__(self) -> None:
        """Start with none."""
        self._read: dict[Path, tuple[tuple[int, int], CellFile | FileFormatError]] = {}

    def read(self, path: Path) -> CellFile:
        """Return what a cell file says; it may have no arms.

        Raises:
            FileFormatError: it cannot be read.
        """
        stamp = _file_stamp(path)
        known = self._read.get(path)
        if known is None or known[0] != stamp:
            known = self._read[path] = stamp, _read_cell_file(path)
        if isinstance(known[1], FileFormatError):
            raise known[1]
        return known[1]

    def read_import(self, folder: Path, name: str) -> ImportedFrames:
        """Return what the IMPORT of a file brings.

        Raises:
            FileFormatError: it cannot be read.
        """
        cell = self.read(folder / name).cell
        return ImportedFrames(frames={frame: node.parent for frame, node in cell.frames.items()}, cell=cell)

    def find_cell(self, folder: Path | None, text: str, setting: Path | None) -> CellFile | None:
        """Return the cell that a program acts on; None where there is none.

        Args:
            folder: where the program lies; None where that is nowhere.
            text: the program.
            setting: the cell file that a setting names.

        Raises:
            FileFormatError: the cell of the setting cannot be read, or has no arms.
        """
        if setting is not None:
            file = self.read(setting)
            if not file.cell.arms:
                raise FileFormatError(setting, None, "", "it has no arms")
            return file
        if folder is None:
            return None
        imported = (folder / name for name in dict.fromkeys(_IMPORT.findall(text)))
        if (first := next(self._read_with_arms(imported), None)) is not None:
            return first
        beside = list(self._read_with_arms(_cell_candidates(folder)))
        return beside[0] if len(beside) == 1 else None

    def _read_with_arms(self, paths: Iterable[Path]) -> Iterator[CellFile]:
        """Give the cell files that can be read and have arms."""
        for path in paths:
            with suppress(FileFormatError):
                if (file := self.read(path)).cell.arms:
                    yield file


def _cell_candidates(folder: Path) -> Iterator[Path]:
    """Give the files of a folder that might be cells."""
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
        if len(paths) <= _MAX_FILES:
            yield from (path for path in paths if path.is_file() and path.stat().st_size <= _LARGEST_FILE)
    except OSError:
        return


def _file_stamp(path: Path) -> tuple[int, int]:
    """Return what changes when a file does."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return 0, -1
    return status.st_mtime_ns, status.st_size


def _read_cell_file(path: Path) -> CellFile | FileFormatError:
    try:
        cell = read_imported_cell(path)
        return CellFile(path=path, cell=cell, lines={} if is_assembly(path) else _declaration_lines(path))
    except FileFormatError as error:
        return error
    except (ArmwrightError, ArithmeticError) as error:
        return FileFormatError(path, None, "", str(error))


def _declaration_lines(path: Path) -> dict[str, int]:
    document = Document.read(path)
    tables = [table for table in ("visions", "frames", "arms") if document.root.is_table(table)]
    lines = {key: document.line((table, key)) for table in tables for key in document.root.table(table)}
    return {_ARM.sub(r"ARM_\1", key).upper(): line for key, line in lines.items() if line is not None}
