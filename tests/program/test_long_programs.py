"""A megabyte of anything is read and checked in some seconds and some hundred megabytes; the rest is counted or cut."""

import pytest

from armwright.errors import FileFormatError, InvalidValueError
from armwright.files.limits import raised
from armwright.program import Source, compile as translate
from armwright.program.diagnostics.render import render
from armwright.program.language.diagnostic import MAX_PER_CODE, DiagnosticList, to_json
from armwright.program.language.source import Span

LONG = 200_000


def test_words_are_counted() -> None:
    """A program with more words than the limit is read up to there; one message says so, and how to read more."""
    text = "VAR n : SCALAR ; { not a word }\nBEGIN\n  n = 1 ;\n  PRINT(n) ;\nEND.\n"
    with raised(words=17):
        assert translate(Source("p.rlo", text)).diagnostics == ()
    with raised(words=16):
        (said,) = translate(Source("p.rlo", text)).diagnostics

    assert said.code == "E119"
    assert said.message == (
        "the program is too long: the limit is 16 words (`armwright --raise words=NUMBER ...` raises it)"
    )
    assert said.span == Span(text.rindex("."), len(text) - 1)


@pytest.mark.parametrize("unit", ["''", "/**/", "n = ) ; "])
def test_messages_of_one_kind_are_counted(unit: str) -> None:
    """Of each code so many messages are kept, and the last of them says that there are more."""
    compiled = translate(Source("p.rlo", unit * (2 * MAX_PER_CODE)))
    codes = [one.code for one in compiled.diagnostics]

    assert compiled.code is None
    assert all(codes.count(code) <= 2 * MAX_PER_CODE for code in set(codes))
    assert any("later ones are not reported" in one.message for one in compiled.diagnostics)


def test_findings() -> None:
    """Whichever way messages are added, they are counted."""
    found, same = DiagnosticList(), DiagnosticList()
    for _ in range(MAX_PER_CODE + 5):
        found.report("E105", "what", Span(0, 1), "here")
    found.report("E106", "another", Span(0, 1), "here")
    same += list(found)
    same.extend(found)

    assert len(found) == MAX_PER_CODE + 1
    assert found[-2].message == "10,000 messages have the code E105; later ones are not reported"
    assert found[-1].message == "another"
    assert len(same) == MAX_PER_CODE + 2


def test_many_torn_names() -> None:
    """A name torn apart very often is put together in one pass."""
    count = 20_000
    compiled = translate(Source("p.rlo", "VAR " + "a 1, " * count + "b : SCALAR ; BEGIN b = 1 END."))

    assert compiled.code is None
    assert {"E106", "E203"} <= {one.code for one in compiled.diagnostics}


@pytest.mark.parametrize(
    "text",
    [
        "BEGIN {} = 1 END.",
        "BEGIN {} END.",
        "BEGIN PRINT(1{}) END.",
        "BEGIN PRINT(9{}.) END.",
        'BEGIN PRINT("{}) END.',
        'IMPORT "{}" ; BEGIN PAUSE 1 END.',
        "VAR n : {} ; BEGIN n = 1 END.",
        "BEGIN MOVE ARM_1 {} TO ARM_1 END.",
        "PROCEDURE {0} ; BEGIN PAUSE 1 END ; BEGIN {0} END.",
    ],
)
def test_messages_are_short(text: str) -> None:
    """A message about a name, a number or a text of a page does not repeat all of it."""
    source = Source("p.rlo", text.replace("{}", "{0}").format("a" * (LONG)))
    said = translate(source).diagnostics
    shown = render(said, source)

    assert said
    assert len(shown) < 60_000
    assert all(len(word) < 5000 for one in said for word in [one.message, one.label, *one.notes, *one.helps])
    assert all(len(to_json(one, source)["message"]) < 5000 for one in said)


def test_errors_are_short() -> None:
    """So it is with every error: the beginning and the end of its text are kept."""
    name = "a" * LONG
    for error in (InvalidValueError(f"no {name} here"), FileFormatError("f.toml", 1, name, "is not known")):
        assert len(str(error)) < 5000
    assert str(InvalidValueError(f"no {name} here")).endswith("aaa here")
    assert str(InvalidValueError("no name here")) == "no name here"
