"""Tables whose column names have units."""

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import given, strategies as st

from armwright.errors import FileFormatError, IncompleteRowsWarning, InvalidValueError, UnknownNameError
from armwright.files.column_map import parse_column_map
from armwright.files.column_names import (
    ANGLE,
    LENGTH,
    NUMBER,
    TIME,
    VELOCITY,
    Column,
    Schema,
    default_units,
    resolve_headings,
)
from armwright.files.limits import raised
from armwright.files.rows import CsvRow
from armwright.files.unit_table import CellText, Header, RequiredCells, UnitTable, read_header, read_headers

Write = Callable[..., Path]
SCHEMA = Schema(
    columns=(
        Column(name="pose"),
        *(Column(name=name, quantity=LENGTH, group="coordinates") for name in "xyz"),
        *(Column(name=f"{name}_nominal", quantity=LENGTH, synonyms=(f"{name}_t",)) for name in "xyz"),
        Column(name="joint_1", quantity=ANGLE, synonyms=("shoulder_pan",), explanation="joint 1 is revolute"),
        Column(name="joint_2", quantity=ANGLE, synonyms=("joint_1",)),
        Column(name="speed", quantity=VELOCITY),
        Column(name="t", quantity=TIME, unit="s"),
        Column(name="qw", quantity=NUMBER),
    )
)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(text: str, name: str = "table.csv") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return written


def rows(header: Header, *filled: str, skip: bool = False) -> UnitTable:
    return header.rows(filled=filled, skip_incomplete=skip)


def refused(action: Callable[[], object]) -> str:
    """Return what is said, without the folder of the file."""
    with pytest.raises(FileFormatError) as caught:
        action()
    return str(caught.value).replace(f"{caught.value.path.parent}/", "")


# ---- names and units -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("x_mm", "x", "mm"),
        (" X [mm] ", "x", "mm"),
        ("x (MM)", "x", "mm"),
        ("x-mm", "x", "mm"),
        ("x.µm", "x", "um"),
        ("x [μm]", "x", "um"),
        ("x_measured_mm", "x", "mm"),
        ("measured x [mm]", "x", "mm"),
        ("x [mm] actual", "x", "mm"),
        ("x_nominal_mm", "x_nominal", "mm"),
        ("nominal x [mm]", "x_nominal", "mm"),
        ("X (mm) Nominal", "x_nominal", "mm"),
        ("target.x.m", "x_nominal", "m"),
        ("commanded_x_in", "x_nominal", "in"),
        ("x_t_mm", "x_nominal", "mm"),
        ("shoulder_pan_rad", "joint_1", "rad"),
        ("Shoulder-Pan [°]", "joint_1", "deg"),
        ("joint_2_mrad", "joint_2", "mrad"),
        ("speed [mm/s]", "speed", "mm_per_s"),
        ("speed_m_per_min", "speed", "m_per_min"),
        ("T", "t", "s"),
        ("t_min", "t", "min"),
        ("QW", "qw", ""),
    ],
)
def test_names(header: str, name: str, unit: str, write: Write) -> None:
    """A column is known by its words, whatever case, blanks, signs and brackets stand around them."""
    (found,) = read_header(write(f'"{header}"\n1\n'), SCHEMA).headings.values()

    assert (found.column.name, found.unit) == (name, unit)


def test_units(write: Write) -> None:
    """Numbers become SI units by the names of their columns; empty cells are NaN, and words stay as they are."""
    table = rows(read_header(write("t_min,x_in,pose,joint_2_deg\n2,10,P1,180\n,1,,0\n"), SCHEMA))

    np.testing.assert_allclose(table.numbers(["x", "joint_2"]), [[0.254, math.pi], [0.0254, 0.0]])
    assert (table.number("t", 0), table.number("t", 1), table.number("z", 0)) == (120.0, None, None)
    assert (table.words("pose"), table.word("pose", 0), table.words("anchor")) == (["P1", ""], "P1", ["", ""])
    assert table.lines.tolist() == [2, 3]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("xx_mm", "no such column. Did you mean 'x_mm'? Known: pose, x_mm, y_mm, z_mm, x_nominal_mm"),
        ("shuolder_pan_rad", "no such column. Did you mean 'shoulder_pan_rad'?"),
        ("pose_mm", "no such column."),
        ("qw_mm", "no such column."),
        ("x_t_t_mm", "no such column."),
        ("nominal", "no such column."),
        ("joint_1_deg", "joint_1 is a name of joint_1 and joint_2; specify which is meant by --columns"),
        ("x", "the name has no unit: expected x_mm or x_m or x_cm or x_um or x_in, in the file or by --columns"),
        ("x_ft", "unknown unit 'ft': expected x_mm or x_m or x_cm or x_um or x_in"),
        ("speed_ft_per_min", "unknown unit 'ft_per_min': expected speed_mm_per_s or"),
        ("y_deg", "deg is a unit of angle: expected y_mm or"),
        ("shoulder_pan_mm", "mm is a unit of length, and joint 1 is revolute: expected joint_1_deg or"),
    ],
)
def test_unknown_names(header: str, message: str, write: Write) -> None:
    """What is no column, or has no unit of it, is refused with what was expected."""
    said = refused(lambda: read_header(write(f"{header}\n1\n"), SCHEMA))

    assert said.startswith(f"table.csv:1: {header}: {message}")


@pytest.mark.parametrize(
    "header", ["-x_mm", " - X [mm]", "[-x] mm", "nominal -x (mm)", "x_nominal (-mm)", "\uff0dx_mm"]
)
def test_minus_before_a_name(header: str, write: Write) -> None:
    """A minus sign in a name is refused, as the numbers below have the other sign; a hyphen between words is none."""
    message = "a minus sign in the name of a column does not apply to its numbers; negate them"

    assert refused(lambda: read_header(write(f"{header}\n1\n"), SCHEMA)) == f"table.csv:1: {header.strip()}: {message}"
    said = refused(lambda: read_header(write("A\n1\n"), SCHEMA, columns={"A": header}))
    assert said == f"table.csv:1: A as {header}: {message}"
    assert [*read_header(write("x-nominal-mm\n1\n"), SCHEMA).headings] == ["x_nominal"]


@pytest.mark.parametrize("separator", [";", ",", "\t"])
def test_separator_after_the_last_cell(separator: str, write: Write) -> None:
    """A separator after the last cell of every line begins no column."""
    text = "pose;x_mm;y_mm;;\nP1;1;2;;\nP2;3;4;;\n".replace(";", separator)

    np.testing.assert_array_equal(
        rows(read_header(write(text), SCHEMA), "x").numbers("xy"), [[1e-3, 2e-3], [3e-3, 4e-3]]
    )
    said = refused(lambda: rows(read_header(write(text.replace(f"4{separator}", "4")), SCHEMA)))
    assert said.startswith("table.csv:3: expected 3 values, one per column, got 4")
    said = refused(
        lambda: rows(read_header(write(f"{text}P3{separator}5{separator}6{separator}{separator}7\n"), SCHEMA))
    )
    assert said == "table.csv:1: '': the last column has no name, but a value in line 4"


def test_nameless_column(write: Write) -> None:
    """A column without a name is none."""
    assert refused(lambda: read_header(write("x_mm,,y_mm\n1,2,3\n"), SCHEMA)).startswith("table.csv:1: '': no such col")


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("x_mm,X [m]", "X [m]: a second column for this quantity, after x_mm"),
        ("x_t_mm,nominal x [mm]", "nominal x [mm]: a second column for this quantity, after x_t_mm"),
        ("x_mm,y_m", "y_m: coordinates must have one unit in a file, but x_mm has another"),
    ],
)
def test_columns_that_do_not_agree(head: str, message: str, write: Write) -> None:
    """A column is there once, and columns of a group have one unit."""
    assert refused(lambda: read_header(write(f"{head}\n1,2\n"), SCHEMA)) == f"table.csv:1: {message}"


def test_passed_over(write: Write) -> None:
    """Columns for people are passed over, and all that are not needed where a table may have others."""
    some = Schema(columns=SCHEMA.columns, ignores_unknown=True)

    assert [*read_header(write("note: warm,x_mm,Notes\n1,2,3\n"), SCHEMA).headings] == ["x"]
    assert [*read_header(write("x_mm,tau1,x_ft,pose_nr\n1,2,3,4\n"), some).headings] == ["x"]
    said = refused(lambda: read_header(write("x_mm,a\n1,2\n"), some, columns={"a": "joint_9_deg"}))
    assert said.startswith("table.csv:1: a as joint_9_deg: no such column.")


def test_stated_units(write: Write) -> None:
    """Units of a whole file are for columns whose names have none."""
    header = read_header(write("x,y,joint_2\n1,2,3\n"), SCHEMA, units=default_units("cm", "mrad"))

    assert [heading.unit for heading in header.headings.values()] == ["cm", "cm", "mrad"]
    with pytest.raises(UnknownNameError, match="no unit of length 'mn'"):
        default_units("mn", "deg")
    assert refused(lambda: read_header(write("x\n1\n"), SCHEMA, units={})).endswith("by --columns or --units")


def test_missing_columns(write: Write) -> None:
    """A column that must be there is named with its usual unit, why, and what is there."""
    header = read_header(write("pose,y_cm\nP,1\n"), SCHEMA)

    assert refused(lambda: header.require(["y", "x"])) == "table.csv:1: x_mm: no such column; there are pose, y_cm"
    said = refused(lambda: header.require(["t"], "paths take time"))
    assert said == "table.csv:1: t: no such column; paths take time; there are pose, y_cm"
    other = read_header(write("a,b\nP,1\n"), attrs.evolve(SCHEMA, ignores_unknown=True))
    assert refused(lambda: other.require(["t"])) == "table.csv:1: t: no such column; there are no known columns"


# ---- column maps ---------------------------------------------------------------------------------------------------


def test_column_map(write: Write) -> None:
    """A file with other names is read by a map, in which names of the schema come before synonyms."""
    columns = {"a1": "joint_1_deg", "A2  ": "joint_2_rad", "Dist. X": "x_mm", "RMS": "note"}
    header = read_header(write("A1,A2,dist.  x,rms\n90,1,2,3\n"), SCHEMA, columns=columns)

    table = rows(header, "x")

    assert [*header.headings] == ["joint_1", "joint_2", "x"]
    np.testing.assert_allclose(table.numbers(["joint_1", "joint_2", "x"]), [[math.pi / 2, 1.0, 2e-3]])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            {"Axis 11": "x_mm"},
            "Axis 11: no such column to map to x_mm; did you mean 'Axis 1'? There are Axis 1, Y",
        ),
        ({"Q": "x_mm"}, "Q: no such column to map to x_mm. There are Axis 1, Y"),
        ({"Axis 1": "xx_mm", "Y": "y_mm"}, "Axis 1 as xx_mm: no such column. Did you mean 'x_mm'?"),
        ({"Axis 1": "x", "Y": "y_mm"}, "Axis 1 as x: the name has no unit"),
        ({"Axis 1": "y_mm", "Y": "y_mm"}, "Y as y_mm: a second column for this quantity, after Axis 1 as y_mm"),
    ],
)
def test_bad_column_maps(columns: Mapping[str, str], message: str, write: Write) -> None:
    """A map of columns that are not there, or to names that are none, is refused."""
    said = refused(lambda: read_header(write("Axis 1,Y\n1,2\n"), SCHEMA, columns=columns))

    assert said.startswith(f"table.csv:1: {message}")


def test_column_maps_of_one_name(write: Write) -> None:
    """Names of a map that a table does not distinguish are refused, not taken for one another."""
    said = refused(lambda: read_header(write("A,b\n1,2\n"), SCHEMA, columns={"A": "x_mm", "a": "y_mm"}))

    assert said == "table.csv:1: a: this name in the column map differs from 'A' only in case or blanks"


def test_long_names_in_column_maps(write: Write) -> None:
    """A name of a map that is not in the file is shortened in the message if it is very long."""
    assert len(refused(lambda: read_header(write("A,b\n1,2\n"), SCHEMA, columns={"c" * 5000: "x_mm"}))) < 200


def test_cells_of_mapped_columns(write: Write) -> None:
    """Messages about cells name the column as it is in the file, and what it is taken for."""
    header = read_header(write("A1\nfar\n"), SCHEMA, columns={"A1": "x_mm"})

    assert refused(lambda: rows(header)) == "table.csv:2: A1 as x_mm: expected a number, got 'far'"


def test_column_map_of_several_files(write: Write) -> None:
    """Of files that belong together one at least has a column of the map."""
    files = [write("A1\n1\n", "a.csv"), write("x_mm\n1\n", "b.csv")]

    assert [[*header.headings] for header in read_headers(files, SCHEMA, columns={"A1": "x_mm"})] == [["x"], ["x"]]
    assert refused(lambda: read_headers(files, SCHEMA, columns={"A2": "x_mm"})).startswith(
        "a.csv:1: A2: no such column"
    )


def test_written_column_maps(write: Write) -> None:
    """A map is typed as pairs, or stands in a file whose names may have commas and equals signs."""
    assert parse_column_map(" A1 = joint_1_deg,X=x_mm") == {"A1": "joint_1_deg", "X": "x_mm"}
    path = write('[columns]\nA1 = "joint_1_deg"\n"X, of the flange" = "x_mm"\n', "map.toml")
    assert parse_column_map(str(path)) == {"A1": "joint_1_deg", "X, of the flange": "x_mm"}


@pytest.mark.parametrize("text", ["A1=", "=x_mm", "A1=x_mm,", "A1=x_mm,y", "A1=x_mm,A1=y_mm", "", " "])
def test_bad_pairs(text: str) -> None:
    """Pairs are a name and another, each name once."""
    with pytest.raises(
        InvalidValueError, match=r"^expected (a column map such as A1=joint_1_deg,X=x_mm|every name once), g"
    ):
        parse_column_map(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "map.toml: columns: missing, expected a table"),
        ("columns = 1\n", "map.toml:1: columns: expected a table, got 1"),
        ("[columns]\nA1 = 1\n", "map.toml:2: columns, A1: expected a text in quotes, got 1"),
        ("[columns]\n[rows]\n", "map.toml:2: rows: unknown key"),
        ("[columns", "map.toml:1: "),
        ("[columns]\na = 'x'\nb = 'y'\nc = 'z'\n", "map.toml:1: columns: too many: 3; the limit is 2 columns"),
    ],
)
def test_bad_files_of_column_maps(text: str, message: str, write: Write) -> None:
    """A file of a column map has one table of texts, no larger than a table has columns."""
    path = write(text, "map.toml")

    with raised(table_columns=2):
        assert refused(lambda: parse_column_map(str(path))).startswith(message)


# ---- rows ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas(separator: str, write: Write) -> None:
    """Between semicolons or tabs numbers may have decimal commas."""
    text = "pose,x_mm,y_mm\nP1,1!5,-2!25e1\nP2,3,4\n".replace(",", separator).replace("!", ",")

    table = rows(read_header(write(text), SCHEMA), "x", "y")

    np.testing.assert_allclose(table.numbers("xy"), [[1.5e-3, -22.5e-3], [3e-3, 4e-3]])


GAPS = "pose,x_mm,y_mm,z_mm\nP1,1,2,3\nP2,,2,\n\n,1,2,3\nP4,1,2,\nP5,4,,\n"


def test_missing_cells(write: Write) -> None:
    """All cells that should not be empty are named in one message."""
    header = read_header(write(GAPS), SCHEMA)

    where = "x_mm in line 3; pose in line 5; y_mm in line 7"
    said = f"table.csv:3: cells are empty: {where}; --skip-incomplete omits 3 rows"
    assert refused(lambda: rows(header, "pose", "x", "y")) == said


def test_one_missing_cell(write: Write) -> None:
    """A cell that is missing alone is named as any other is."""
    header = read_header(write("pose,x_mm\nP1,1\nP2,\n"), SCHEMA)

    said = "table.csv:3: x_mm: empty; expected a number, or --skip-incomplete to omit the row"
    assert refused(lambda: rows(header, "x")) == said


def test_incomplete_rows_left_out(write: Write) -> None:
    """Incomplete rows are left out where that is asked for, with a warning that counts and names them."""
    header = read_header(write(GAPS), SCHEMA)

    with pytest.warns(IncompleteRowsWarning) as caught:
        table = rows(header, "pose", "x", "y", skip=True)

    assert [str(one.message).rpartition("/")[2] for one in caught] == [
        "table.csv: 3 rows omitted because of empty cells, 2 read: x_mm in line 3; pose in line 5; y_mm in line 7"
    ]
    assert table.words("pose") == ["P1", "P4"]
    assert table.lines.tolist() == [2, 6]


def test_cells_that_other_cells_require(write: Write) -> None:
    """A row may require a cell, or one of several, because of another cell; a column of it must be in the file."""

    def required(cell_text: CellText) -> list[RequiredCells]:
        return [RequiredCells(("z", "y"), "a number")] if cell_text("pose") in {"P2", "P5"} else []

    path = write(GAPS.replace("P2,,2", "P2,,"))
    header = read_header(path, SCHEMA)
    said = refused(lambda: header.rows(filled=("pose",), required=required))
    assert said == (
        "table.csv:3: cells are empty: z_mm or y_mm in lines 3, 7; pose in line 5; --skip-incomplete omits 3 rows"
    )

    header = read_header(path, SCHEMA)
    said = refused(lambda: header.rows(filled=(), required=lambda _: [RequiredCells(("speed", "t"), "a number")]))
    assert said == "table.csv:2: speed_mm_per_s: no such column; expected a number; there are pose, x_mm, y_mm, z_mm"


def test_nothing_but_gaps(write: Write) -> None:
    """A table without a complete row is none, even where incomplete rows are left out."""
    header = read_header(write("pose,x_mm\nP1,\nP2,\n"), SCHEMA)

    said = "table.csv:2: every row has empty cells: x_mm in lines 2, 3"
    assert refused(lambda: rows(header, "x", skip=True)) == said


def test_very_many_missing_cells(write: Write) -> None:
    """Of very many lines a message names the first, and counts the others."""
    header = read_header(write("pose,x_mm\n" + "P,\n" * 5000 + "P,1\n"), SCHEMA)

    said = refused(lambda: rows(header, "x"))

    assert said.endswith("19, 20, 21 and 4980 more; --skip-incomplete omits 5000 rows")
    assert len(said) < 300


@pytest.mark.parametrize(("word", "hint"), [("chek", "; did you mean 'check'?"), ("", ""), ("zzz", "")])
def test_choices(word: str, hint: str, write: Write) -> None:
    """A word that is one of few is refused where it is none of them."""
    table = rows(read_header(write(f"pose,x_mm\nCHECK,1\n{word},2\n"), SCHEMA))

    assert table.choice("pose", 0, ("fit", "check")) == "check"
    said = refused(lambda: table.choice("pose", 1, ("fit", "check")))
    assert said == f"table.csv:3: pose: expected fit or check, got '{word}'{hint}"


@given(st.text(min_size=1).filter(str.strip))
def test_any_name(text: str) -> None:
    """Whatever the name of a column is, it is one of the schema, passed over, or refused by a message."""
    with suppress(FileFormatError):
        found = resolve_headings(Path("t.csv"), CsvRow(1, (text,)), SCHEMA, {}, {"length": "mm"})
        assert all(heading.column in SCHEMA.columns for heading in found.values())
