"""Options of the commands that read tables: which columns are which, and what becomes of rows with empty cells."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

import typer

ColumnMap: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--columns",
        help="What columns of the table are: A1=joint_1_deg,X=x_mm, or a TOML file with [columns] (docs/tables.md).",
    ),
]
SkipIncomplete: TypeAlias = Annotated[
    bool, typer.Option("--skip-incomplete", help="Leave out rows with empty cells, and say how many.")
]


class TableFile(NamedTuple):
    """A table to be read, and how.

    Attributes:
        path: of the file.
        columns: names of columns, with unit, by those in the file.
        skip_incomplete: leave out rows with cells that should not be empty.
    """

    path: Path
    columns: Mapping[str, str] | None = None
    skip_incomplete: bool = False


def columns_of(text: str | None) -> dict[str, str] | None:
    """Read a column map; None where there is none.

    Raises:
        BadParameter: it is neither pairs of names nor a file.
        FileFormatError: the file is missing or broken.
    """
    if text is None:
        return None
    from armwright.errors import InvalidValueError
    from armwright.files.column_map import column_map

    try:
        return column_map(text)
    except InvalidValueError as error:
        raise typer.BadParameter(str(error), param_hint="--columns") from error


def table_file(path: Path | None, columns: str | None, *, skip_incomplete: bool) -> TableFile | None:
    """Return what is read of ``--csv``; None where no file is given.

    Raises:
        BadParameter: the other options are given without it.
    """
    if path is not None:
        return TableFile(path, columns_of(columns), skip_incomplete)
    for option, value in (("--columns", columns), ("--skip-incomplete", skip_incomplete)):
        if value:
            raise typer.BadParameter("there is no table to read: give --csv FILE", param_hint=option)
    return None
