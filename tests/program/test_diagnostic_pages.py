"""What a code means: pages with programs that are what they say."""

import re
import runpy
from pathlib import Path

import pytest

import armwright.program
from armwright.errors import UnknownNameError
from armwright.export.examples import diagnose_example
from armwright.program.diagnostics.index import codes, codes_by_range, find_page
from armwright.program.language.source import Source
from armwright.program.language.words import VOCABULARIES, Standard

SOURCES = Path(armwright.program.__file__).parent
DOCS = Path(__file__).parents[2] / "docs"
MESSAGES = (DOCS / "messages.md").read_text(encoding="utf-8")


def test_every_code_has_a_page() -> None:
    """Whatever is said of a program is explained, and nothing is explained that is never said."""
    folders = (SOURCES, SOURCES.parent / "physics", SOURCES.parent / "export")
    texts = [path.read_text(encoding="utf-8") for folder in folders for path in folder.rglob("*.py")]

    said = {code for text in texts for code in re.findall(r'"([EWLR]\d{3})"', text)}

    assert said == set(codes())


@pytest.mark.parametrize("code", codes())
def test_wrong_program(code: str) -> None:
    """The wrong program of a page gets this message and no other."""
    said = diagnose_example(Source("wrong.rlo", find_page(code).wrong))

    assert {one.code for one in said} == {code}


@pytest.mark.parametrize("code", codes())
def test_right_program(code: str) -> None:
    """Of the right program of a page nothing is said at all, not even while it runs."""
    assert diagnose_example(Source("right.rlo", find_page(code).right)) == ()


@pytest.mark.parametrize("code", codes())
def test_form(code: str) -> None:
    """A title is short and no sentence; the text under it is two to six sentences in plain words."""
    page = find_page(code)

    assert (page.code, len(page.title) <= 60, page.title[-1].isalnum()) == (code, True, True)
    first = page.title.split()[0].rstrip(",")
    assert first.islower() or first in VOCABULARIES[Standard.RLO_2].reserved | {"WORLD"}
    sentences = re.findall(r"[.?!](?= [A-Z`]|$)", page.text)
    assert 2 <= len(sentences) <= 6
    assert page.text.count("`") % 2 == 0
    assert page.wrong != page.right


def test_no_title_twice() -> None:
    """Two codes that mean the same would be one."""
    titles = [find_page(code).title for code in codes()]

    assert len(set(titles)) == len(titles)


def test_run_time_pages_run() -> None:
    """What is said only while a program runs is shown by a program that runs."""
    for code in (
        "E401",
        "E402",
        "E403",
        "E404",
        "E405",
        "E406",
        "E407",
        "E408",
        "E409",
        "E410",
        "E411",
        "E412",
        "E413",
        "E414",
        "E504",
        "E505",
        "E506",
        "E611",
        "E612",
        "E613",
        "E614",
        "E615",
        "E616",
        "E617",
        "E618",
        "R601",
        "R603",
        "R604",
        "R605",
        "R606",
        "R607",
        "W401",
        "W402",
        "W403",
        "W404",
        "W405",
    ):
        assert "// run in " in find_page(code).wrong, code


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("E206", "E206"),
        ("e206", "E206"),
        ("E0206", "E206"),
        ("206", "E206"),
        (" 0206 ", "E206"),
        ("301", "E301"),  # an error before a word on style
        ("L301", "L301"),
        ("w0402", "W402"),
        ("601", "R601"),
        ("304", "E304"),
    ],
)
def test_ways_to_ask(asked: str, meant: str) -> None:
    """A code is found in any case, with zeros in front of its number, and by its number alone."""
    assert find_page(asked).code == meant


def test_unknown_code() -> None:
    """Who asks for a code that does not exist is told the nearest, and those of its range."""
    with pytest.raises(UnknownNameError, match=r"no code 'E209x'. Did you mean 'E209'\? Known: E201, ") as caught:
        find_page("E209x")
    assert "E301" not in str(caught.value)


@pytest.mark.parametrize("asked", ["", "999", "E", "help", "EE206", "E2066", "E206 E207"])
def test_no_code(asked: str) -> None:
    """What is no code is told so, with a list of what there is."""
    with pytest.raises(UnknownNameError, match=rf"no code '{asked}'.*Known: E"):
        find_page(asked)


def test_ranges() -> None:
    """Every code belongs to one range, in the order in which all are listed."""
    assert tuple(code for several in codes_by_range().values() for code in several) == codes()


def test_the_page_of_messages_is_up_to_date() -> None:
    """The page of all messages says what the package says; `make messages` writes it anew."""
    assert runpy.run_path(str(DOCS / "make_messages.py"))["text"]() == MESSAGES


def test_every_row_of_the_page_leads_somewhere() -> None:
    """The table names each code once, and each row leads to a section."""
    rows = re.findall(r"^\| \[(\w+)\]\(#(\w+)\) \|", MESSAGES, re.MULTILINE)

    assert [code for code, _ in rows] == list(codes())
    assert [f"### {anchor.upper()}" for _, anchor in rows] == re.findall(r"^### \w+$", MESSAGES, re.MULTILINE)


def test_every_cell_of_a_page_is_told() -> None:
    """The page of messages says what the cells are in which its programs run."""
    cells = {path.stem for path in (SOURCES / "diagnostics" / "pages" / "cells").glob("*.toml")}
    used = {name for code in codes() for name in re.findall(r"// run in (\w+)", find_page(code).wrong)}

    assert used == cells == set(re.findall(r"\(`(\w+)`\)", MESSAGES))
