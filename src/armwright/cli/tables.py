"""Options of the commands that read tables: the map of columns, and the treatment of rows with empty cells."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

from typer import Option

from armwright.cli.options import usage_error

Units: TypeAlias = Annotated[str | None, Option(help="Units of measurements whose header has none, as in mm,deg.")]
ColumnMap: TypeAlias = Annotated[
    str | None,
    Option(
        "--columns",
        help="Map of column names, as in A1=joint_1_deg,X=x_mm, or a TOML file with [columns] (docs/tables.md).",
    ),
]
SkipIncomplete: TypeAlias = Annotated[
    bool, Option("--skip-incomplete", help="Omit rows with empty cells, and report their number.")
]


class TableFile(NamedTuple):
    """A file with a table, and how to read it.

    Attributes:
        path: path of the file.
        columns: names of columns with unit, by their names in the file.
        skip_incomplete: whether rows with empty cells in required columns are omitted.
    """

    path: Path
    columns: Mapping[str, str] | None = None
    skip_incomplete: bool = False


def columns_of(text: str | None) -> dict[str, str] | None:
    """Read a column map; None without a text.

    Raises:
        BadParameter: the text is neither pairs of names nor a file.
        FileFormatError: the file is missing or broken.
    """
    if text is None:
        return None
    from armwright.errors import InvalidValueError
    from armwright.files.column_map import parse_column_map

    try:
        return parse_column_map(text)
    except InvalidValueError as error:
        raise usage_error("--columns", str(error)) from error


def table_file(path: Path | None, columns: str | None, *, skip_incomplete: bool) -> TableFile | None:
    """Return the table of ``--csv``; None without a path.

    Raises:
        BadParameter: options of a table are present without the table.
    """
    if path is not None:
        return TableFile(path, columns_of(columns), skip_incomplete)
    for option, value in (("--columns", columns), ("--skip-incomplete", skip_incomplete)):
        if value:
            raise usage_error(option, "expected a table, --csv FILE, with this option")
    return None
