"""The line of every key of a TOML or JSON text."""

import json
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, strategies as st

from armwright.files.key_lines import DuplicateKeyError, Keys, LineTree, json_lines, toml_lines

# Names that need quotes, name nothing or look like something else; a number makes each unique.
WORDS = ("mass_kg", "a-b", "12", "true", "", "a b", "x.y", "[t]", "k = 1", "#no", "it's", 'say "q"', "tab\t", "é", "\\")
# Values that look like keys, headers and comments, and end where a careless reader does not expect it.
SCALARS = (
    "1",
    "-2.5e3",
    "true",
    "1979-05-27 07:32:00",
    '""',
    "''",
    '"a # b"',
    '"k = 1"',
    r'"\" = \\"',
    r"'C:\dir'",
    "'say \"q\"'",
    '"""one"""',
    '"""\n[head]\nk = 1  # no\n"""',
    '"""ends with a quote""""',
    '"""\\"""\n"""',
    "'''\n[[k]]\n'''",
    "''''quoted' ''''",
    '["a]b", [1, 2], {x = "}"}]',
    "[ # why\n  1,\n\n  [2, 3], # two\n]",
    "{}",
    "[]",
)


def every_line(tree: LineTree, keys: Keys = ()) -> Iterator[tuple[Keys, int]]:
    """Give the way to every value with its line."""
    for key, below in tree.children.items():
        if isinstance(below, LineTree):
            yield (*keys, key), below.line
            yield from every_line(below, (*keys, key))
        else:
            yield (*keys, key), below


class Writer:
    """Writes TOML and notes in which line it wrote which key: counting line feeds is all it needs for that."""

    def __init__(self, data: st.DataObject) -> None:
        self.data, self.text, self.lines, self.names = data, "", {}, 0

    def choose(self, choices: Any) -> Any:
        """Draw one."""
        return self.data.draw(st.sampled_from(choices))

    def note(self, keys: Keys) -> None:
        """Note a key in the line that is being written, unless it stands above already."""
        self.lines.setdefault(keys, self.text.count("\n") + 1)

    def name(self) -> tuple[str, str]:
        """A new name, and one of the ways to write it."""
        self.names += 1
        name = f"{self.choose(WORDS)}{self.names}"
        ways = [json.dumps(name, ensure_ascii=self.choose((True, False))), '"' + "".join(map(escaped, name)) + '"']
        if name.isascii() and name.replace("_", "").replace("-", "").isalnum():
            ways += [name] * 3
        if "'" not in name:
            ways.append(f"'{name}'")
        return name, self.choose(ways)

    def blank(self) -> None:
        """Write what separates keys, and looks like some."""
        self.text += self.choose(("", "", "\n", "  \n\t\n", "# k = 1\n", "#[head]\n\n"))

    def pair(self, table: Keys, depth: int = 0) -> None:
        """Write a key, dotted or not, and its value."""
        keys = table
        for _ in range(self.choose((1, 1, 1, 2, 3))):
            self.text += "" if keys == table else self.choose((".", " . "))
            name, written = self.name()
            keys = (*keys, name)
            self.note(keys)
            self.text += written
        self.text += self.choose(("=", " = ", "\t=  "))
        self.value(keys, depth)

    def value(self, keys: Keys, depth: int) -> None:
        """Write a value, and note the keys and elements in it."""
        kind = self.choose(("scalar", "scalar", "inline table", "list")) if depth < 2 else "scalar"
        if kind == "inline table":
            self.text += "{ "
            for i in range(self.choose((1, 2))):
                self.text += ", " if i else ""
                self.pair(keys, depth + 1)
            self.text += " }"
        elif kind == "list":
            self.text += "["
            for i in range(self.choose((1, 2, 3))):
                self.text += self.choose(("", "\n  ", " # one\n"))
                self.note((*keys, i))
                self.value((*keys, i), depth + 1)
                self.text += self.choose((",", " ,", "\n,"))
            self.text += "]"
        else:
            self.text += self.choose([value for value in SCALARS if value[0] not in "[{"])

    def pairs(self, table: Keys) -> None:
        """Write some keys of a table."""
        for _ in range(self.choose((0, 1, 2))):
            self.blank()
            self.pair(table)
            self.text += self.choose(("\n", "  # k = 1\n"))

    def section(self) -> None:
        """Write a table with a table below it, or an array of tables with tables below each of them."""
        name, written = self.name()
        below, written_below = self.name()
        if self.choose((True, False)):
            for i in range(self.choose((1, 2, 3))):
                self.blank()
                self.note((name,))
                self.note((name, i))
                self.text += f"[[{written}]]  # [[no]]\n"
                self.pairs((name, i))
                self.note((name, i, below))
                self.text += f"[{written} . {written_below}]\n"
                self.pairs((name, i, below))
        else:
            self.note((name,))
            self.note((name, below))
            self.text += f"[ {written}.{written_below} ]\n"
            self.pairs((name, below))


def escaped(letter: str) -> str:
    return f"\\U{ord(letter):08x}"


def entries(value: Any, keys: Keys = ()) -> list[Keys]:
    """Every way to a key or an element."""
    found: list[Keys] = []
    for key, below in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        found += [(*keys, key), *entries(below, (*keys, key))]
    return found


@given(st.data())
def test_lines_of_toml(data: st.DataObject) -> None:
    """Whatever the style, every key of a TOML document is told in the line in which it was written."""
    writer = Writer(data)
    writer.pairs(())
    for _ in range(writer.choose((0, 1, 2))):
        writer.section()
    writer.blank()

    found = dict(every_line(toml_lines(writer.text)))

    assert found == writer.lines
    assert set(found) == set(entries(tomllib.loads(writer.text)))


@pytest.mark.parametrize("value", SCALARS)
def test_values_do_not_hide_the_next_key(value: str) -> None:
    """A key stands one line below the value before it, whatever that value contains."""
    text = f"first = {value}\nsecond = 2\n"

    assert tomllib.loads(text)["second"] == 2
    assert toml_lines(text).line_of(("second",)) == text.count("\n")


def test_arm_file() -> None:
    """A table below the second of two [[joint]] belongs to that one."""
    text = 'title = "two"\n\n[[joint]]\nd_m = 1\n[joint.link]\nmass_kg = 1\n[[joint]]\n[joint.link]\nmass_kg = 2\n'

    lines = dict(every_line(toml_lines(text)))

    assert lines["joint", 0] == 3
    assert lines["joint", 0, "link", "mass_kg"] == 6
    assert lines["joint", 1] == 7
    assert lines["joint", 1, "link", "mass_kg"] == 9


def test_a_table_opened_after_its_child() -> None:
    """[a.b] names a in passing; once [a] has a header of its own, that is where it stands."""
    assert toml_lines("[a.b]\nx = 1\n[a]\ny = 2\n").line_of(("a",)) == 3


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda below: st.lists(below, max_size=4) | st.dictionaries(st.text(), below, max_size=4),
    max_leaves=15,
)


def one_entry_a_line(value: Any, keys: Keys, line: int, lines: dict[Keys, int]) -> int:
    """Note the lines of ``json.dumps(..., indent)``: one for each entry, one for each bracket that closes several."""
    below = (
        list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else []
    )
    for key, entry in below:
        lines[*keys, key] = line + 1
        line = one_entry_a_line(entry, (*keys, key), line + 1, lines)
    return line + bool(below)


@given(st.dictionaries(st.text(), json_values, max_size=5), st.integers(0, 3), st.booleans())
def test_lines_of_json(value: dict[str, Any], indent: int, ascii_only: bool) -> None:  # noqa: FBT001
    """In JSON with one entry a line, every entry is told in its line; strings do not mislead."""
    lines: dict[Keys, int] = {}
    one_entry_a_line(value, (), 1, lines)

    assert dict(every_line(json_lines(json.dumps(value, indent=indent, ensure_ascii=ascii_only)))) == lines


@given(st.dictionaries(st.text(), json_values, max_size=5))
def test_json_in_one_line(value: dict[str, Any]) -> None:
    """Everything in a JSON text of one line stands in line 1."""
    assert dict(every_line(json_lines(json.dumps(value)))) == dict.fromkeys(entries(value), 1)


def test_twin_keys() -> None:
    """The second of two keys of one object is found; the same key in another object, or as a value, is none."""
    assert json_lines('{"a": "b", "b": {"a": 1},\n "c": [{"a": 1}, {"a": 2}]}').line_of(("c", 1, "a")) == 2
    with pytest.raises(DuplicateKeyError) as caught:
        json_lines('{"a": "b",\n "c": {"b": 1},\n "b": 0,\n "c": {"x": 1}}')

    assert (caught.value.keys, caught.value.line) == (("c",), 4)
