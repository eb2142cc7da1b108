"""The extension for Visual Studio Code: its grammar, and what the editor is told of the language."""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, example, given, settings, strategies as st
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace

from armwright.program.language.units import UNITS
from armwright.program.language.words import BLOCK_CLOSERS, BLOCK_OPENERS, SENSORS
from armwright.program.language_server.highlight import (
    CONTEXT_PATTERNS,
    DECLARATIONS,
    KEYWORDS,
    OPERATORS,
    TYPES,
    RloLexer,
)
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED
from editors.textmate import Engine
from program.shelf import ACCEPTED, CORPUS, REJECTED
from samples import examples

EXTENSION = Path(__file__).parents[2] / "editors" / "vscode"
GRAMMAR = json.loads((EXTENSION / "syntaxes" / "rlo.tmLanguage.json").read_text(encoding="utf-8"))
LANGUAGE = json.loads((EXTENSION / "language-configuration.json").read_text(encoding="utf-8"))
MANIFEST = json.loads((EXTENSION / "package.json").read_text(encoding="utf-8"))
PROGRAMS = [*sorted(CORPUS.glob("*.rlo")), *ACCEPTED, *REJECTED]

# Groups of words by their scope.
GROUPS = {
    "keyword.declaration.rlo": DECLARATIONS,
    "storage.type.rlo": TYPES,
    "keyword.operator.wordlike.rlo": OPERATORS,
    "keyword.control.rlo": KEYWORDS,
    "support.function.rlo": FUNCTIONS.keys(),
    "variable.language.rlo": PREDECLARED.keys(),
    "keyword.other.unit.rlo": UNITS.keys(),
}

# What Pygments calls a scope, by its beginning; the longest beginning counts.
COLOURS = {
    "comment": Comment,
    "constant.numeric": Number,
    "constant.numeric.line-number": Name.Label,
    "entity.name.function": Name.Function,
    "invalid": Error,
    "keyword.control": Keyword,
    "keyword.declaration": Keyword.Declaration,
    "keyword.operator": Operator,
    "keyword.operator.wordlike": Operator.Word,
    "keyword.other.sensor": Keyword.Pseudo,
    "keyword.other.unit": Keyword.Type,
    "punctuation": Punctuation,
    "punctuation.definition.comment": Comment,
    "storage.type": Keyword.Type,
    "string": String.Double,
    "support.function": Name.Builtin,
    "variable.language": Name.Builtin.Pseudo,
    "variable.other": Name,
}

_SCRAPS = (
    *(DECLARATIONS | TYPES | OPERATORS | KEYWORDS | UNITS.keys() | FUNCTIONS.keys() | PREDECLARED.keys()),
    *(
        "ARM_1",
        "arm-2",
        "ARM",
        "x",
        "zero",
        "a_1",
        "1",
        "0.5",
        "1E5",
        "2mm",
        "10 ",
        "\n100 ",
        '"text"',
        "{ a }",
        "// b\n",
    ),
    *("<=", "<>", ">=", *" \t\n;,.:=()[]+-*/<>#'{}_"),
)


def rules(node: Any) -> Iterator[Mapping[str, Any]]:
    """Yield every object in a part of the grammar."""
    if isinstance(node, dict):
        yield node
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from rules(inner)


def words_of(scope: str) -> list[str]:
    """Return the words of the rule that gives a scope to words alone."""
    in_context = [rule["match"] for rule in rules(GRAMMAR["repository"]["context"]) if "match" in rule]
    patterns = (
        rule["match"]
        for rule in rules(GRAMMAR)
        if rule.get("name") == scope and rule.get("match", in_context[0]) not in in_context
    )
    (words,) = (found[1] for pattern in patterns if (found := re.match(r"\(\?i\)\(\?:([A-Z0-9|]+)\)\(\?[=!]", pattern)))
    return words.split("|")


def colour_of(scope: str) -> Any:
    beginnings = [beginning for beginning in COLOURS if scope.startswith(beginning)]
    return COLOURS[max(beginnings, key=len)]


def by_grammar(text: str) -> list[tuple[str, Any]]:
    """Return each character but blanks with its colour."""
    return [
        (character, colour_of(scope) if scope else None)
        for piece, scope in Engine(GRAMMAR).pieces(text)
        for character in piece
        if not character.isspace()
    ]


def by_pygments(text: str) -> list[tuple[str, Any]]:
    """Return the same as Pygments has it, which knows two kinds of comments."""
    return [
        (character, Comment if kind in Comment else kind)
        for _, kind, piece in RloLexer().get_tokens_unprocessed(text)
        if kind is not Whitespace
        for character in piece
        if not character.isspace()
    ]


@pytest.mark.parametrize("scope", sorted(GROUPS))
def test_words(scope: str) -> None:
    """The grammar has exactly the words of the language, each in its group."""
    written = words_of(scope)

    assert sorted(written) == sorted(GROUPS[scope])


@pytest.mark.parametrize("word", sorted(DECLARATIONS | TYPES | OPERATORS | KEYWORDS))
def test_word_in_any_case(word: str) -> None:
    """A reserved word has one scope in any case, and a longer name has none of these."""
    (expected,) = (scope for scope, words in GROUPS.items() if word in words and scope.partition(".")[0] != "support")
    for written in (word, word.lower(), word.capitalize()):
        assert [(piece, scope) for piece, scope in Engine(GRAMMAR).pieces(written) if piece] == [(written, expected)]
    assert set(by_grammar(f"{word}x")) == {(character, Name) for character in f"{word}x"}


def test_words_in_context() -> None:
    """The grammar has the patterns of the words that are names elsewhere."""
    scopes = {"declaration": "keyword.declaration.rlo", "type": "storage.type.rlo", "keyword": "keyword.control.rlo"}
    written = [(rule["name"], rule["match"]) for rule in GRAMMAR["repository"]["context"]["patterns"]]

    assert written == [
        (scopes[kind], f"(?i){pattern}") for kind, pattern in CONTEXT_PATTERNS if not pattern.startswith("FUNCTION")
    ]


def test_sensors() -> None:
    """VISIONS and SYSTEM are words behind READ alone."""
    for sensor in SENSORS:
        assert dict(Engine(GRAMMAR).pieces(f"READ {sensor}"))[sensor] == "keyword.other.sensor.rlo"
        assert dict(Engine(GRAMMAR).pieces(sensor))[sensor] == "variable.other.rlo"


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_as_pygments(path: Path) -> None:
    """Every character of every program has the same colour in the grammar and in Pygments."""
    text = path.read_text(encoding="utf-8")

    assert by_grammar(text) == by_pygments(text)


@settings(max_examples=examples(200))
@given(st.lists(st.sampled_from(sorted(_SCRAPS)), max_size=25).map("".join))
@example("UNITS/")
@example("ABS.ABS. a.b.. PROCEDURE a.b READ SYSTEM.x ZERO FORCE.y UNITS MM.z")
@example("BRAKEEND\nRESUMEELSE )SMOOTHLYEND SMOOTHLYVIA(")
def test_as_pygments_of_anything(text: str) -> None:
    """So has every character of texts that are no programs, unless a construction goes on over the end of a line."""
    # The grammar looks at one line at a time: it does not see what comes behind READ or PROCEDURE in the next.
    assume(not re.search(r"(?i)\b(READ|PROCEDURE)\s*(\n|\{|//)", text))

    assert by_grammar(text) == by_pygments(text)


def test_every_pattern_in_use() -> None:
    """Every part of the grammar is included somewhere, and every inclusion names one."""
    included = {rule["include"] for rule in rules(GRAMMAR) if "include" in rule}

    assert included == {f"#{name}" for name in GRAMMAR["repository"]}


@pytest.mark.parametrize("path", sorted(CORPUS.glob("*.rlo")), ids=lambda path: path.stem)
def test_folding(path: Path) -> None:
    """In the conformance programs as many stretches open as close, and none closes before it opens."""
    markers = LANGUAGE["folding"]["markers"]
    depth = 0
    for line in path.read_text(encoding="utf-8").splitlines():
        depth += bool(re.search(markers["start"], line)) - bool(re.search(markers["end"], line))
        assert depth >= 0

    assert depth == 0


@pytest.mark.parametrize("opening", sorted(BLOCK_OPENERS))
@pytest.mark.parametrize("closing", sorted(BLOCK_CLOSERS))
def test_folding_words(opening: str, closing: str) -> None:
    """What opens a stretch of statements opens a fold and indents; what closes one does the opposite."""
    markers, indent = LANGUAGE["folding"]["markers"], LANGUAGE["indentationRules"]
    increase, decrease = (
        re.compile(indent[f"{which}IndentPattern"]["pattern"], re.IGNORECASE) for which in ("increase", "decrease")
    )

    for written in (f"  {opening}", f"100 {opening.lower()}", f"  PRIORITY 2 : {opening} x = 1 ;"):
        assert re.search(markers["start"], written)
        assert increase.search(written)
        assert not re.search(markers["end"], written)
    for written in (f"  {closing} ;", f"100 {closing.lower()}.", f"{closing}"):
        assert re.search(markers["end"], written)
        assert decrease.search(written)
        assert not re.search(markers["start"], written)
    for written in (f"{opening} x = 1 {closing}", f"// {opening}", f"{{ {opening}", f"{opening}S = 1", f"a{opening}"):
        assert not re.search(markers["start"], written)
        assert not increase.search(written)


def test_manifest() -> None:
    """The manifest names files that are there, one language, and a launch by what a program needs."""
    gives = MANIFEST["contributes"]
    (language,), (grammar,), (debugger,) = gives["languages"], gives["grammars"], gives["debuggers"]

    assert (language["id"], language["extensions"]) == ("rlo", [".rlo"])
    assert (EXTENSION / language["configuration"]).is_file()
    assert (EXTENSION / grammar["path"]).is_file()
    assert (grammar["language"], grammar["scopeName"]) == ("rlo", GRAMMAR["scopeName"])
    launch = debugger["configurationAttributes"]["launch"]["properties"]
    assert list(launch) == ["program", "cell", "arguments", "std", "strict", "stopOnEntry", "output"]
    assert all(
        set(configuration) - {"type", "request", "name"} <= set(launch)
        for configuration in debugger["initialConfigurations"]
    )
    settings = ["armwright.path", "armwright.cell", "armwright.std", "armwright.strict"]
    assert list(gives["configuration"]["properties"]) == settings
