"""Reading files that people write: what is read, and what every mistake is answered with."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from armwright.errors import FileFormatError
from armwright.files.document import Document, Table
from armwright.files.inputs import read_text


@pytest.fixture
def at(tmp_path: Path) -> Callable[..., Table]:
    """Write a text into a file and stand at its top."""

    def write(text: str, name: str = "thing.toml") -> Table:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return Document.read(tmp_path / name).root

    return write


def refused(path: Path, action: Callable[[], Any]) -> str:
    """What is said of a mistake, without the folder of the file."""
    with pytest.raises(FileFormatError) as caught:
        action()
    return str(caught.value).replace(f"{path}/", "")


def test_everything_is_read(at: Callable[..., Table]) -> None:
    """Numbers, vectors, texts, choices and tables come back as they are written, whole numbers as floats."""
    top = at(
        'mass_kg = 2\ncom_m = [0, -0.5, 1e3]\nname = "it"\nkind = "b"\nrows = [[1, 2], [3, 4]]\n'
        "[hand]\nreach_m = 1.5\n[[joint]]\nd_m = 1\n[[joint]]\nd_m = 2\n"
    )

    assert top.number("mass_kg") == 2.0
    assert isinstance(top.number("mass_kg"), float)
    np.testing.assert_array_equal(top.vector("com_m", 3), (0.0, -0.5, 1000.0))
    np.testing.assert_array_equal(top.vectors("rows", 2), ((1, 2), (3, 4)))
    assert top.text("name") == "it"
    assert top.choice("kind", ("a", "b")) == "b"
    assert top.table("hand").positive("reach_m") == 1.5
    assert [joint.number("d_m") for joint in top.tables("joint")] == [1.0, 2.0]
    top.refuse_unknown_keys()


def test_what_is_not_given_has_its_default(at: Callable[..., Table]) -> None:
    """A key that may be left out reads as its default, a table as an empty one, and neither is complained about."""
    top = at("")

    assert top.number("mass_kg", default=0) == 0.0
    assert top.number("reach_m", default=math.inf) == math.inf
    assert top.text("name", default="x") == "x"
    assert top.choice("kind", ("a", "b"), default="a") == "a"
    assert top.table("hand").positive("reach_m", default=1.0) == 1.0
    np.testing.assert_array_equal(top.vector("com_m", 3, default=(1, 2, 3)), (1, 2, 3))
    assert "name" not in top
    top.refuse_unknown_keys()


def test_toml_and_json_say_the_same(at: Callable[..., Table]) -> None:
    """The ending of its name tells what a file is; where it tells nothing, a brace at the beginning means JSON."""
    text = '\n {"mass_kg": 2}'

    for name in ("a.json", "a.JSON", "a.cell", "a"):
        assert at(text, name).number("mass_kg") == 2
    for name in ("a.toml", "a.cell", "a"):
        assert at("mass_kg = 2", name).number("mass_kg") == 2


def test_names_that_are_free(at: Callable[..., Table]) -> None:
    """The keys of a table of frames are names: they come in the order of the file."""
    frames = at("[frames.PART]\nx = 1\n[frames.BOX]\nx = 2\n").table("frames")

    assert list(frames) == ["PART", "BOX"]
    assert [frames.table(key).number("x") for key in frames] == [1, 2]
    assert frames.is_table("PART")
    assert not frames.table("PART").is_table("x")


def test_windows_files(tmp_path: Path) -> None:
    """A mark of byte order and carriage returns change neither values nor lines."""
    path = tmp_path / "thing.toml"
    path.write_bytes('\ufeffname = "it"\r\n\r\nmass_kg = true\r\n'.encode())
    top = Document.read(path).root

    assert top.text("name") == "it"
    said = refused(tmp_path, lambda: top.number("mass_kg"))
    assert said == "thing.toml:3: mass_kg: expected a number, got the truth value true"


WRONG = {
    "a text for a number": ("\nm = 'x'", lambda t: t.number("m"), "2: m: expected a number, got the text 'x'"),
    "a truth value for a number": (
        "m = true",
        lambda t: t.number("m"),
        "1: m: expected a number, got the truth value true",
    ),
    "a list for a number": ("m = [1, 2]", lambda t: t.number("m"), "1: m: expected a number, got a list of 2"),
    "a table for a number": ("[m]\nx = 1", lambda t: t.number("m"), "1: m: expected a number, got a table"),
    "a date for a number": ("m = 1979-05-27", lambda t: t.number("m"), "1: m: expected a number, got 1979-05-27"),
    "no number at all": ("m = nan", lambda t: t.number("m"), "1: m: expected a finite number, got nan"),
    "an infinite number": ("m = -inf", lambda t: t.number("m"), "1: m: expected a finite number, got -inf"),
    "a number beyond floats": (
        f"m = 1{'0' * 400}",
        lambda t: t.number("m"),
        "1: m: expected a number no larger than 1e+100, got an integer of many digits",
    ),
    "a number beyond reason": (
        "m = -1e101",
        lambda t: t.number("m"),
        "1: m: expected a number no larger than 1e+100, got -1e+101",
    ),
    "too small": ("m = -1", lambda t: t.number("m", lower=0), "1: m: expected 0 or more, got -1"),
    "too large": ("m = 7", lambda t: t.number("m", upper=5), "1: m: expected 5 or less, got 7"),
    "out of bounds": ("m = 7", lambda t: t.number("m", lower=0.1, upper=5), "1: m: expected 0.1 to 5, got 7"),
    "zero where only more makes sense": ("m = 0", lambda t: t.positive("m"), "1: m: expected a number above 0, got 0"),
    "a number for a text": ("m = 3", lambda t: t.text("m"), "1: m: expected a text in quotes, got 3"),
    "a number for a choice": ("m = 3", lambda t: t.choice("m", "ab"), "1: m: expected a text in quotes, got 3"),
    "a misspelt choice": (
        "m = 'revolut'",
        lambda t: t.choice("m", ("revolute", "prismatic")),
        "1: m: expected one of prismatic, revolute, got the text 'revolut'; did you mean 'revolute'?",
    ),
    "a choice that is none": (
        "m = 'helical'",
        lambda t: t.choice("m", ("revolute", "prismatic")),
        "1: m: expected one of prismatic, revolute, got the text 'helical'",
    ),
    "a number for a vector": ("m = 3", lambda t: t.vector("m", 3), "1: m: expected a list of 3 numbers, got 3"),
    "a short vector": ("m = [1, 2]", lambda t: t.vector("m", 3), "1: m: expected 3 numbers, got 2"),
    "neither of two lengths": ("m = [1]", lambda t: t.vector("m", (3, 6)), "1: m: expected 3 or 6 numbers, got 1"),
    "a text in a vector": (
        "m = [\n  1,\n  'x',\n]",
        lambda t: t.vector("m", 2),
        "3: m 2: expected a number, got the text 'x'",
    ),
    "a number that is none in a vector": (
        "m = [1, nan]",
        lambda t: t.vector("m", 2),
        "1: m 2: expected a finite number, got nan",
    ),
    "a short row": (
        "m = [[1, 2],\n  [3]]",
        lambda t: t.vectors("m", 2),
        "2: m 2: expected 2 numbers, got 1",
    ),
    "a vector for a matrix": (
        "m = [1, 2]",
        lambda t: t.vectors("m", 2),
        "1: m 1: expected a list of 2 numbers, got 1",
    ),
    "a number for a matrix": (
        "m = 1",
        lambda t: t.vectors("m", 2),
        "1: m: expected a list of lists of 2 numbers, got 1",
    ),
    "a number for a table": ("\n\nm = 1", lambda t: t.table("m"), "3: m: expected a table, got 1"),
    "one table for several": (
        "[m]\nx = 1",
        lambda t: t.tables("m"),
        "1: m: expected one or more tables [[m]], got a table",
    ),
    "no table of several": (
        "m = []",
        lambda t: t.tables("m"),
        "1: m: expected one or more tables [[m]], got a list of 0",
    ),
    "a missing number": ("", lambda t: t.number("m"), " m: missing, expected a number"),
    "a missing text": ("", lambda t: t.text("m"), " m: missing, expected a text in quotes"),
    "a missing vector": ("", lambda t: t.vector("m", (3, 6)), " m: missing, expected a list of 3 or 6 numbers"),
    "a missing matrix": ("", lambda t: t.vectors("m", 3), " m: missing, expected a list of lists of 3 numbers"),
    "a missing choice": ("", lambda t: t.choice("m", ("b", "a")), " m: missing, expected one of a, b"),
    "a missing table": ("", lambda t: t.table("m", required=True), " m: missing, expected a table"),
    "missing tables": ("", lambda t: t.tables("m"), " m: missing, expected one or more tables [[m]]"),
    "missing in a table": (
        "x = 1\n[hand]\ny = 1",
        lambda t: t.table("hand").number("m"),
        "2: hand, m: missing, expected a number",
    ),
    "misspelt and so missing": (
        "[hand]\nreech_m = 1",
        lambda t: t.table("hand").number("reach_m"),
        "1: hand, reach_m: missing, expected a number; was 'reech_m' meant?",
    ),
    "wrong in the second of several": (
        "[[joint]]\n[[joint]]\n[joint.link]\n\nmass_kg = 'x'",
        lambda t: t.tables("joint")[1].table("link").number("mass_kg"),
        "5: joint 2, link, mass_kg: expected a number, got the text 'x'",
    ),
    "wrong of the whole table": ("\n[hand]", lambda t: _raise(t.table("hand").error(None, "no")), "2: hand: no"),
    "a long text": (
        f"m = '{'x' * 200}'",
        lambda t: t.number("m"),
        f"1: m: expected a number, got the text '{'x' * 59}...",
    ),
    "a key that cannot be seen": (
        "' ' = 'x'",
        lambda t: t.number(" "),
        "1: ' ': expected a number, got the text 'x'",
    ),
    "wrong in JSON": (
        '{"hand": {\n  "reach_m": null}}',
        lambda t: t.table("hand").number("reach_m"),
        "2: hand, reach_m: expected a number, got null",
    ),
}


def _raise(error: Exception) -> None:
    raise error


@pytest.mark.parametrize("case", WRONG)
def test_mistakes(case: str, at: Callable[..., Table], tmp_path: Path) -> None:
    """A mistake is told with file, line and key, with what was expected and what was got."""
    text, read, said = WRONG[case]
    table = at(text, "thing")

    assert refused(tmp_path, lambda: read(table)) == f"thing:{said}"


UNKNOWN = {
    "near a key that was not given": ("reech_m = 1", "1: reech_m: unknown key; did you mean 'reach_m'?"),
    "near a key that was given": ("reach_m = 1\nreech_m = 1", "2: reech_m: unknown key; known keys: name, reach_m"),
    "near nothing": ("weight = 1", "1: weight: unknown key; known keys: name, reach_m"),
    "a table": ("name = 'a'\n\n[weights]\nx = 1", "3: weights: unknown key; known keys: name, reach_m"),
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_unknown_keys(case: str, at: Callable[..., Table], tmp_path: Path) -> None:
    """A key that nobody reads is refused; the nearest that could still be given is named, or all that are known."""
    text, said = UNKNOWN[case]
    top = at(text)
    top.text("name", default="")
    top.allow("reach_m")

    assert refused(tmp_path, top.refuse_unknown_keys) == f"thing.toml:{said}"


def test_nothing_is_known(at: Callable[..., Table], tmp_path: Path) -> None:
    """In a table that must be empty, every key is unknown and none can be offered."""
    top = at("[camera]\nx = 1")

    assert (
        refused(tmp_path, top.table("camera").refuse_unknown_keys)
        == "thing.toml:2: camera, x: unknown key; no keys are allowed here"
    )


TOO_DEEP = " nested too deeply: the limit is 60 levels (`armwright --raise nesting=NUMBER ...` raises it)"
TOO_MANY_DIGITS = (
    " an integer in it has too many digits: the limit is 1,000 digits (`armwright --raise digits=NUMBER ...` raises it)"
)
BROKEN = {
    "no value": ("a.toml", "x = 1\nmass_kg =\n", "2: not valid TOML: Invalid value, column 10"),
    "an open list": ("a.toml", "x = 1\ny = [1,\n\n", "2: not valid TOML: Invalid value, at the end of the file"),
    "the same key twice": ("a.toml", "x = 1\n\nx = 2\n", "3: not valid TOML: Cannot overwrite a value, column 6"),
    "no JSON value": ("a.json", '{\n "x": }', "2: not valid JSON: Expecting value, column 7"),
    "nothing": ("a.json", "", "1: not valid JSON: Expecting value, column 1"),
    "a JSON key twice": ("a.json", '{"x": 1, "y": [{"x": 1}],\n "x": 2}', "2: x: this key occurs twice"),
    "a JSON key twice, below": ("a.json", '{"y": [0, {"x": 1,\n"x": 1}]}', "2: y 2, x: this key occurs twice"),
    "a JSON list": ("a.json", "[1, 2]", "1: expected keys and values in braces, got a list of 2"),
    "deep lists": ("a.toml", f"x = {'[' * 9000}{']' * 9000}", TOO_DEEP),
    "deep JSON": ("a.json", f'{{"x": {"[" * 200000}{"]" * 200000}}}', TOO_DEEP),
    "many digits": ("a.toml", f"x = 1{'0' * 5000}", TOO_MANY_DIGITS),
    "many digits in JSON": ("a.json", f'{{"x": 1{"0" * 5000}}}', TOO_MANY_DIGITS),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files(case: str, at: Callable[..., Table], tmp_path: Path) -> None:
    """A file that is no TOML or JSON is refused with the line at which reading stopped."""
    name, text, said = BROKEN[case]

    assert refused(tmp_path, lambda: at(text, name)) == f"{name}:{said}"


def test_not_utf_8(tmp_path: Path) -> None:
    """Text in another encoding is refused where its first foreign byte stands."""
    (tmp_path / "a.toml").write_bytes(b"x = 1\n# caf\xe9\n")

    said = refused(tmp_path, lambda: read_text(tmp_path / "a.toml"))
    assert said == "a.toml:2: not UTF-8 text: byte 0xe9 is invalid; save it as UTF-8"

    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbfx = 1\n\xe9\n")
    said = refused(tmp_path, lambda: read_text(tmp_path / "a.toml"))
    assert said == "a.toml:2: not UTF-8 text: byte 0xe9 is invalid; save it as UTF-8"


def test_missing_file(tmp_path: Path) -> None:
    """A file that does not exist is told, with the nearest name in its folder."""
    (tmp_path / "stanford.toml").touch()

    said = refused(tmp_path, lambda: Document.read(tmp_path / "standford.toml"))
    assert said == "standford.toml: no such file; did you mean 'stanford.toml'?"
    assert refused(tmp_path, lambda: Document.read(tmp_path / "cell.toml")) == "cell.toml: no such file"
    assert refused(tmp_path, lambda: Document.read(tmp_path / "no" / "a.toml")) == "no/a.toml: no such file"
    assert refused(tmp_path, lambda: Document.read("a\0.toml")) == "'a\\x00.toml': no file can have this name"


def test_folder_for_a_file(tmp_path: Path) -> None:
    """A folder is no file, and a file is no folder."""
    (tmp_path / "cells").mkdir()
    (tmp_path / "a.toml").touch()

    assert refused(tmp_path, lambda: Document.read(tmp_path / "cells")) == "cells: expected a file, got a folder"
    said = refused(tmp_path, lambda: Document.read(tmp_path / "a.toml" / "b.toml"))
    assert said == "a.toml/b.toml: cannot be read: Not a directory"


# Pieces of TOML and JSON in any order: mostly nonsense, now and then a file.
PIECES = st.sampled_from(
    [*"{}[]\"'=:,.#\n\r\t\\aé1", "[[", "]]", '"""', "'''", "\\u00e9", '"b"', "-0x1f", "1e5", "nan", "true", "null"]
)


@given(pieces=st.lists(PIECES | st.text(max_size=3), max_size=12), ending=st.sampled_from(("json", "toml", "cell")))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text(pieces: list[str], ending: str, tmp_path: Path) -> None:
    """Whatever is in a file, it is read or refused as a file: nothing else goes wrong."""
    path = tmp_path / f"any.{ending}"
    path.write_text("".join(pieces), encoding="utf-8", newline="")

    try:
        root = Document.read(path).root
    except FileFormatError as error:
        said = str(error)
    else:
        keys = list(root)
        said = refused(tmp_path, root.refuse_unknown_keys) if keys else f"{path}"

    assert said.startswith((str(path), path.name))
