"""Analysis of a text: it is compiled in its surroundings, with the cell and the imports that belong to it."""

from pathlib import Path

import attrs

from armwright.program.api import compile as compile_program, with_imports
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.cell_lookup import Cells
from armwright.program.semantics.cell_symbols import Imported


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


def analyse(name: str, codec: PositionCodec, folder: Path | None, cells: Cells, settings: Settings) -> Analysis:
    """Analyse a program with its cell and its imports; intermediate code is not generated.

    Args:
        name: the name of the program, as messages show it.
        codec: of the text of the program.
        folder: the folder of the program; None for a text without a file.
        cells: the cells read so far.
        settings: cell, standard and strictness.
    """
    around = cells.around(folder, codec.text, settings.cell)
    imports: list[Path] = []

    def read_import(path: str) -> Imported:
        assert folder is not None  # noqa: S101 - imports are read only with a folder
        imported = cells.imported(folder, path)
        imports.append(folder / path)
        return imported

    compiled = compile_program(
        Source(name, codec.text),
        None if around.file is None else around.file.cell,
        strict=settings.strict,
        std=settings.std,
        read_import=None if folder is None else read_import,
        generate_code=False,
    )
    files = [cells.read(path) for path in imports]
    if around.file is not None:
        files.append(around.file)
    lines = {name: (file.path.absolute().as_uri(), line) for file in files for name, line in file.lines.items()}
    # Where nothing has arms, an imported file still tells where its frames are.
    imported = (imported.cell for imported in compiled.imports)
    cell = compiled.cell or with_imports(next(filter(None, imported), None), compiled.imports)
    return Analysis(compiled=compiled, codec=codec, cell=cell, files=lines, problem=around.problem)
