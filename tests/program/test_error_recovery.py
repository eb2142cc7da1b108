"""Programs that were damaged: something sensible is said about each, and nothing breaks."""

import time
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from armwright.program import Compilation, Source, compile as translate
from armwright.program.diagnostics.render import render
from armwright.program.language.diagnostic import Fix
from program.shelf import ACCEPTED, BARE, CORPUS, REJECTED, compile_file

TEXTS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(CORPUS.glob("*.rlo"))}
# How much longer eight times the program may take: twice eight, for the noise of the machine; squared it were 64.
LINEAR = 16.0


def mutated(text: str, at: int, how: str) -> str:
    """Return a program with one token dropped, doubled, or swapped with the next."""
    tokens = translate(Source("t.rlo", text)).tokens[:-1]
    one = tokens[at % (len(tokens) - 1)]
    two = tokens[at % (len(tokens) - 1) + 1]
    if how == "drop":
        return text[: one.start] + text[one.end :]
    if how == "double":
        return f"{text[: one.end]} {one.text}{text[one.end :]}"
    return text[: one.start] + two.text + text[one.end : two.start] + one.text + text[two.end :]


@given(
    name=st.sampled_from(sorted(TEXTS)),
    at=st.integers(0, 1000),
    how=st.sampled_from(["drop", "double", "swap"]),
    with_cell=st.booleans(),
)
def test_mutated_programs(name: str, at: int, how: str, with_cell: bool) -> None:  # noqa: FBT001
    """A program with one slip raises nothing; it has errors with places in the text, or it has code."""
    compilation = translate(Source("t.rlo", mutated(TEXTS[name], at, how)), BARE if with_cell else None)

    assert (compilation.code is None) == any(one.is_error for one in compilation.diagnostics)
    assert render(compilation.diagnostics, compilation.source)
    assert all(one.span.end <= len(compilation.source.text) for one in compilation.diagnostics)


@pytest.mark.parametrize("name", ["p01", "p02", "p04", "p05", "p06", "p07", "p08"])
@pytest.mark.drawn(0.4)
def test_one_slip_gives_few_messages(name: str) -> None:
    """One slip of one token gives at most five messages, and in nine cases of ten at most two."""
    counts = []
    for how in ("drop", "double", "swap"):
        for at in range(0, len(TEXTS[name]) // 4, 3):
            found = translate(Source("t.rlo", mutated(TEXTS[name], at, how))).diagnostics
            counts.append(sum(one.is_error for one in found))

    assert max(counts) <= 5
    assert sum(count <= 2 for count in counts) >= 0.9 * len(counts)


@given(st.text(max_size=80))
def test_any_text(text: str) -> None:
    """No text whatever raises; what is no program has at least one error."""
    compilation = translate(Source("t.rlo", text))

    assert (compilation.code is None) == any(one.is_error for one in compilation.diagnostics)


WORDS = """
    VAR BEGIN END . ; , ( ) = : := ARM_1 ARM - 1 12 MOVE TO WITH VIA APPROACH SPEED DIRECTLY AT AFFIX UNFIX FROM OPEN
    GRASP OPERATE READ VISIONS SYSTEM f g FRAME SCALAR FOR DO IF [ ] * + ON COBEGIN COEND UNTIL PROCEDURE ARRAY 5mm
"""


@given(st.lists(st.sampled_from(WORDS.split()), max_size=40))
def test_any_words(words: list[str]) -> None:
    """No order of the words of the language raises or goes on for ever."""
    compilation = translate(Source("t.rlo", " ".join(words)), BARE)

    assert (compilation.code is None) == any(one.is_error for one in compilation.diagnostics)


def curable() -> list[tuple[Path, Compilation, int]]:
    compiled = [(path, compile_file(path)) for path in [*REJECTED, *ACCEPTED]]
    return [(path, one, at) for path, one in compiled for at, said in enumerate(one.diagnostics) if said.fixes]


CURABLE = curable()


@pytest.mark.parametrize(("path", "compilation", "at"), CURABLE, ids=lambda value: getattr(value, "stem", None))
def test_fixes_cure(path: Path, compilation: Compilation, at: int) -> None:
    """The change that a message offers makes the message go away and brings no other of its kind."""
    wrong = compilation.diagnostics[at]
    text = applied(compilation.source.text, wrong.fixes)
    after = translate(Source(path.name, text))

    before_count = sum(one.code == wrong.code for one in compilation.diagnostics)
    assert sum(one.code == wrong.code for one in after.diagnostics) < before_count
    assert sum(one.is_syntax for one in after.diagnostics) <= sum(one.is_syntax for one in compilation.diagnostics)


def test_many_kinds_of_fixes() -> None:
    """Many kinds of slips come with a certain cure."""
    assert len({compilation.diagnostics[at].code for _, compilation, at in CURABLE}) >= 9


def applied(text: str, fixes: tuple[Fix, ...]) -> str:
    for fix in sorted(fixes, key=lambda one: one.span.start, reverse=True):
        text = text[: fix.span.start] + fix.replacement + text[fix.span.end :]
    return text


def test_linear_time() -> None:
    """Eight times as long a program takes about eight times as long."""
    short, long = (min(_seconds(count) for _ in range(2)) for count in (500, 4000))

    assert long < LINEAR * short


def _seconds(count: int) -> float:
    statements = "MOVE ARM_1 TO f WITH APPROACH = g, VIA (v, w) ;\nAFFIX g TO f ; UNFIX g FROM f ;\n" * count
    text = (
        "VAR f, g, v, w : FRAME ; BEGIN READ VISIONS (f) ; READ VISIONS (g) ; READ VISIONS (v) ; READ VISIONS (w) ;\n"
    )
    started = time.process_time()
    assert translate(Source("long.rlo", f"{text}{statements}END.")).code is not None
    return time.process_time() - started


@pytest.mark.parametrize(
    "junk",
    [
        "(",
        "BEGIN ",
        "(*",
        "- ",
        '"',
        "a,",
        "IF a THEN ",
        "BEGIN n = (",
        "VAR a : FRAME ; BEGIN MOVE ",
        "１",
        "END BEGIN ",
        "; END . BEGIN ",
    ],
)
def test_deeply_nested_junk(junk: str) -> None:
    """No depth of nesting and no repetition exhausts the parser."""
    assert translate(Source("t.rlo", junk * 3000)).code is None
