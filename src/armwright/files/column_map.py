"""Column maps: which columns of somebody's file are those that a reader expects."""

from pathlib import Path

from armwright.errors import InvalidValueError, shown
from armwright.files.document import Document
from armwright.files.limits import limit, limit_message


def parse_column_map(text: str) -> dict[str, str]:
    """Return the names that columns are taken for, by their names in the file.

    Args:
        text: such as ``A1=joint_1_deg,X=x_mm``, or the path of a TOML file with a table ``[columns]`` of such pairs.

    Raises:
        InvalidValueError: the text is neither.
        FileFormatError: the file is missing or broken, or says something else.
    """
    if not text.strip():
        raise InvalidValueError("expected a column map such as A1=joint_1_deg,X=x_mm, got an empty text")
    if "=" not in text:
        return _read_column_map(Path(text))
    found: dict[str, str] = {}
    for part in text.split(","):
        name, _, target = (word.strip() for word in part.rpartition("="))
        if not name or not target or name in found:
            expected = "every name once" if name in found else "a column map such as A1=joint_1_deg,X=x_mm"
            raise InvalidValueError(f"expected {expected}, got {shown(part)}")
        found[name] = target
    return found


def _read_column_map(path: Path) -> dict[str, str]:
    root = Document.read(path).root
    table = root.table("columns", required=True)
    root.refuse_unknown_keys()
    names = list(table)
    if len(names) > limit("table_columns"):
        raise root.error("columns", f"too many: {limit_message('table_columns', len(names))}")
    return {name: table.text(name) for name in names}
