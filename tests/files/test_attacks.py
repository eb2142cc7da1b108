"""Files nobody would write: whatever the parsers accept is scanned, whatever they refuse is told."""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings, strategies as st

from armwright.errors import FileFormatError
from armwright.files.document import Document
from armwright.files.key_lines import DuplicateKeyError, Keys, LineTree, json_lines, toml_lines
from samples import examples

# What TOML is made of, and what a careless reader stumbles over.
TOML_PIECES = (
    *(
        "a",
        "b",
        "a.b",
        "a . b.c",
        '"a"',
        "'a'",
        '"a.b"',
        '""',
        "''",
        r'"\u0061"',
        r'"\\"',
        '"\\"',
        '"]"',
        "'\"'",
        "1e5",
    ),
    *(
        "=",
        " = ",
        "\n",
        "\n",
        "\n",
        "\r\n",
        " ",
        "\t",
        "#",
        "# ]\n",
        "#[[a]]\n",
        ",",
        ".",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
    ),
    *("1", "-inf", "nan", "1979-05-27T07:32:00Z", "07:32:00", "true", '"""', "'''", '"', "'", "\\", '\\"', "x\ny"),
    *("a = 1\n", "[a]\n", "[b]\n", "[[c]]\n", "[c.d]\n", "[[c.e]]\n", "[c.e.f]\n", "b.c = 1\n", "d = [\n{x = 1},\n]\n"),
    *(
        "k = '''a''''\n",
        'm = """a"""""\n',
        'n = """\\\n  a"""\n',
        "o = {a.b = 1, c = [1, {d = 2}]}\n",
        "\u2028",
        "\x85",
    ),
)
JSON_PIECES = (
    *("{", "}", "[", "]", ",", ":", " ", "\n", "\r", "\t", '"a"', '"b"', '"\\u0061"', '"\\""', '"\\\\"', '"]"', '"#"'),
    *(
        "1",
        "-1.5e3",
        "null",
        "true",
        "NaN",
        "-Infinity",
        '"',
        "'",
        "\\",
        "#",
        '{"a": 1}',
        '{"a": {"b": [1]}}',
        "[1, 2]",
    ),
)


def entries(value: Any, keys: Keys = ()) -> list[Keys]:
    """Every way to a key or an element."""
    below = (
        list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else []
    )
    return [way for key, entry in below for way in ((*keys, key), *entries(entry, (*keys, key)))]


def every_line(tree: LineTree, keys: Keys = ()) -> Iterator[tuple[Keys, int]]:
    """Yield the keys of every value with its line."""
    for key, below in tree.children.items():
        if isinstance(below, LineTree):
            yield (*keys, key), below.line
            yield from every_line(below, (*keys, key))
        else:
            yield (*keys, key), below


def check_toml(text: str) -> bool:
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return False
    text = text.replace("\r\n", "\n")
    lines = dict(every_line(toml_lines(text)))
    assert set(lines) == set(entries(data))
    assert set(lines.values()) <= set(range(1, text.count("\n") + 2))
    return True


@settings(max_examples=examples(250))
@given(st.lists(st.sampled_from(TOML_PIECES), max_size=12).map("".join))
@example('a = "\\"" # "\nb = \'\\\'\n')
@example("\"\".'' = 2\n")
def test_what_toml_accepts(text: str) -> None:
    """Every text that the parser accepts is scanned, and exactly its keys are found."""
    check_toml(text)


VALID = (
    "a = '''x''''\nb = '''y'''''\nc = ''''z'''\n",
    'a = """x""""\nb = """y"""""\nc = """"z"""\nd = """"""\ne = """\\""""\n',
    'a = """\\\n   \n  x\\\\"""\nb = 1\n',
    'a = "#" # "\nb = \'#\' # \'\n"#" = 1\n',
    '"a.b".c = 1\n"a.b".\'c.d\' = 2\n[a."b.c"]\nx = 1\n[ "]" . \'[[\' ]\nx = 1\n',
    "3.14 = 1\n1e5 = 2\n- = 3\n1979-05-27 = 4\ntrue = 5\n",
    "a = 1979-05-27 07:32:00\nb = [1979-05-27, 07:32:00.5] # ]\nc = 1979-05-27T07:32:00-07:00\n",
    "a = 1\r\nb = '''\r\nx\r\n'''\r\n[c]\r\nd = 1 # e\r\n",
    "a = [\n  {x = 1}, # {\n\n  {y = {z = [\n 1,\n 2, ]}},\n]\nb = [[], [[]], {}]\n",
    "[[a]]\nx = 1\n[a.b.c]\ny = 1\n[[a.b.d]]\nz = 1\n[a.b.d.e]\nz = 2\n[[a]]\n[a.b.c]\ny = 2\n[[a.b.d]]\n[[a.b.d]]\n",
    "[a.b.c]\n[a]\nx.y = 1\nx.z = 2\n[a.b]\n",
    "[[ a . 'b' ]]\n[[a.b]]\n[ a . b . \"c\" ]\nd=1",
    '"\\u00e9\\U0001F600\\t" = 1\n"\\"" = 2\n\'\\\' = 3\n',
    "a = {b.c = 1, 'd'.\"e\" = 2}\nf = +1_000\ng = 0xdead_beef\nh = -inf\n",
    "# only a comment",
    "",
    "a = '\u2028'\nb = 2 # \u2028\x85\u2029\nc = 3\n",
    f"{'a.' * 60}a = 1\n",
    f"a = {'[' * 60}{']' * 60}\nb = {'{a = ' * 60}1{'}' * 60}\n",
)


@pytest.mark.parametrize("text", VALID)
def test_odd_toml(text: str) -> None:
    """Odd, but TOML: strings that end in quotes, keys that look like values, headers under headers."""
    assert check_toml(text)


@pytest.mark.parametrize("text", VALID)
@settings(max_examples=12)
@given(st.data())
def test_odd_toml_with_a_slip(text: str, data: st.DataObject) -> None:
    """The same with a letter lost, doubled or put elsewhere: refused, or scanned as well as before."""
    at, other = (data.draw(st.integers(0, max(0, len(text) - 1))) for _ in range(2))
    check_toml(
        text[:at] + data.draw(st.sampled_from(("", text[at : at + 1] * 2, text[other : other + 1]))) + text[at + 1 :]
    )


@settings(max_examples=examples(250))
@given(st.lists(st.sampled_from(JSON_PIECES), max_size=10).map("".join), st.booleans())
def test_what_json_accepts(text: str, braced: bool) -> None:  # noqa: FBT001
    """Every text that the parser accepts is scanned: exactly its keys are found, or one that is given twice."""
    text = f'{{"k": {text}}}' if braced else text
    objects: list[list[str]] = []
    try:
        json.loads(text, object_pairs_hook=lambda members: objects.append([key for key, _ in members]))
    except json.JSONDecodeError:
        return
    if any(len(keys) > len(set(keys)) for keys in objects):
        with pytest.raises(DuplicateKeyError):
            json_lines(text)
        return
    lines = dict(every_line(json_lines(text)))
    assert set(lines) == set(entries(json.loads(text)))
    assert set(lines.values()) <= set(range(1, text.count("\n") + 2))


def refusal(path: Path) -> str | None:
    """What is said of a file, or None when it can be read."""
    try:
        Document.read(path)
    except FileFormatError as error:
        return str(error)
    return None


@settings(max_examples=examples(100))
@given(
    st.binary(max_size=40) | st.lists(st.sampled_from(TOML_PIECES)).map(lambda p: "".join(p).encode()), st.booleans()
)
def test_any_file(tmp_path_factory: pytest.TempPathFactory, data: bytes, as_json: bool) -> None:  # noqa: FBT001
    """Whatever a file holds, it is read or refused with its name; nothing else can happen."""
    path = tmp_path_factory.getbasetemp() / ("any.json" if as_json else "any.toml")
    path.write_bytes(data)

    said = refusal(path)

    assert said is None or (said.startswith(f"{path}:") and "\n" not in said)


def test_a_name_that_cannot_be_seen(tmp_path: Path) -> None:
    """A key without letters, or of line feeds, is told in its own line and in quotes, on one line."""
    for name, written in (("", '""'), (" ", "' '"), ("a\nb", '"a\\nb"')):
        (tmp_path / "a.toml").write_text(f"\n{written} = 1\n")

        with pytest.raises(FileFormatError, match=r"a\.toml:2: ") as caught:
            Document.read(tmp_path / "a.toml").root.refuse_unknown_keys()

        assert str(caught.value).endswith(f": {name!r}: unknown key; no keys are allowed here")
