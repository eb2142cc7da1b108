"""Certain cures: they make their messages go away, bring no new slips, and what is left is told."""

from pathlib import Path

import pytest

from armwright.program import Compilation, Source, compile as translate
from armwright.program.diagnostics.fixes import FixResult, apply_fixes, select_disjoint
from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Span
from armwright.program.language.words import Standard
from program.shelf import CORPUS, OLD, REJECTED, cell_of, imports_of

# What is left out of the conformance programs, one at a time.
SIGNS = (";", ".", "=", ",", "(", ")", "BEGIN", "DO", "TO", "WITH")
PROGRAMS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(CORPUS.glob("p0*.rlo"))}


def cure(text: str) -> FixResult:
    return apply_fixes(Source("t.rlo", text), translate)


def slips(compilation: Compilation) -> list[Diagnostic]:
    return [one for one in compilation.diagnostics if one.is_syntax]


def tokens(text: str) -> list[tuple[str, int, int]]:
    return [(one.key, one.start, one.end) for one in translate(Source("t.rlo", text)).tokens]


@pytest.mark.drawn(0.12)
@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_one_sign_left_out(name: str, sign: str) -> None:
    """A cure that is offered for a sign that was left out makes its message go away and brings no other slip."""
    text = PROGRAMS[name]
    places = [(start, end) for key, start, end in tokens(text) if key == sign]
    for start, end in places[:: max(1, len(places) // 12)]:
        damaged = Source("t.rlo", text[:start] + text[end:])
        before = translate(damaged)
        offered = select_disjoint(one for one in before.diagnostics if one.fixes)
        result = apply_fixes(damaged, translate)
        if not offered:
            assert result.text == damaged.text
            continue
        cured = [one for one in result.applied if one.diagnostic.is_syntax]
        assert len(slips(result.compilation)) <= len(slips(before)) - len(cured)
        assert not {one.message for one in result.compilation.diagnostics} & {
            one.diagnostic.message for one in result.applied
        }


@pytest.mark.parametrize("sign", [";", ".", "WITH"])
@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_all_of_a_sign_left_out(name: str, sign: str) -> None:
    """A program without a single `;`, or full stop, or WITH, has no errors any more after its cure."""
    text = PROGRAMS[name]
    damaged = text
    for key, start, end in reversed(tokens(text)):
        if key == sign:
            damaged = damaged[:start] + damaged[end:]
    result = cure(damaged)

    assert not any(one.is_error for one in result.compilation.diagnostics)
    # The last `;` in front of END is not missed.
    words = [one.key for one in result.compilation.tokens if one.key != ";"]
    assert words == [key for key, _, _ in tokens(text) if key != ";"]


@pytest.mark.parametrize("path", REJECTED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_rejected_programs(path: Path) -> None:
    """What can be cured of a wrong program is cured; nothing is worse afterwards."""
    text = path.read_text(encoding="utf-8")
    std = Standard.RLO_83 if OLD.search(text) else Standard.RLO_2

    def in_its_cell(source: Source) -> Compilation:
        return translate(source, cell_of(text), std=std, read_import=imports_of(text))

    before = in_its_cell(Source(path.name, text))
    result = apply_fixes(before.source, in_its_cell)

    assert len(slips(result.compilation)) <= len(slips(before))
    assert bool(result.applied) == (result.text != text)
    if not any(one.fixes for one in before.diagnostics):
        assert not result.applied


def test_rounds() -> None:
    """One cure may bring the next slip to light: of two signs missing at one place each has its round."""
    text = "VAR f : FRAME ; BEGIN READ VISIONS (f\n MOVE ARM_1 TO f END."
    result = cure(text)

    assert result.text == "VAR f : FRAME ; BEGIN READ VISIONS (f);\n MOVE ARM_1 TO f END."
    assert [one.description for one in result.applied] == ["inserted `)`", "inserted `;`"]
    assert apply_fixes(Source("t.rlo", text), translate, rounds=1).text == text.replace("(f\n", "(f)\n")


def test_words_for_cures() -> None:
    """What was done is told: put in, left out, or written for something else."""
    result = cure("VAR f : FRAME ; n : SCALAR ; BEGIN n := +5 ; f = ARM - 1 ; MOVE ARM_1 TO f WITH SPEED n END.")

    assert [one.description for one in result.applied] == [
        "replaced `:=` by `=`",
        "removed `+`",
        "replaced `ARM - 1` by `ARM_1`",
        "inserted `=`",
    ]
    assert result.text == "VAR f : FRAME ; n : SCALAR ; BEGIN n = 5 ; f = ARM_1 ; MOVE ARM_1 TO f WITH SPEED = n END."


def test_matrix_row_by_row() -> None:
    """Numbers in the order of another convention are put in order, as long as they make sense then."""
    result = cure("VAR f : FRAME ; BEGIN f = (0,-1,0,0.5, 1,0,0,0.1, 0,0,1,0.2) ; MOVE ARM_1 TO f END.")

    assert "f = (0,1,0, -1,0,0, 0,0,1, 0.5,0.1,0.2) ;" in result.text
    assert not result.compilation.diagnostics
    assert "by `(0,1,0, -1,0,0, 0,0,1, 0.5,0." in result.applied[0].description


def complaining(*fixes: Fix, code: str = "E101", message: str = "wrong") -> Diagnostic:
    return Diagnostic(code=code, message=message, span=fixes[0].span, fixes=fixes)


def test_changes_that_touch() -> None:
    """Of two changes of one place only the first is made; a change of two places is made whole or not at all."""
    first = complaining(Fix(Span(2, 4), "x"))
    beside = complaining(Fix(Span(4, 4), "y"))
    around = complaining(Fix(Span(0, 0), "("), Fix(Span(3, 3), ")"))
    far = complaining(Fix(Span(9, 9), "z"))

    assert select_disjoint([far, beside, first]) == [first, far]
    assert select_disjoint([first, around, far]) == [around, far]


def test_vain_change() -> None:
    """A change that leaves its message, or brings another slip, is not made; those beside it are."""

    def find(source: Source) -> Compilation:
        found = translate(Source(source.name, "BEGIN END."))
        said = []
        for letter, code, cured in (("a", "E104", "b"), ("c", "E105", "d")):
            at = source.text.find(letter)
            if at >= 0:
                said.append(complaining(Fix(Span(at, at + 1), cured), code=code, message=letter))
        if "d" in source.text:
            at = source.text.find("d")
            said.append(complaining(Fix(Span(at + 2, at + 2), ""), code="E111", message="worse"))
        return Compilation(
            source=source,
            standard=found.standard,
            tokens=found.tokens,
            comments=found.comments,
            tree=found.tree,
            symbols=found.symbols,
            imports=found.imports,
            flow=found.flow,
            diagnostics=tuple(said),
            code=None,
        )

    result = apply_fixes(Source("t.rlo", "a  c  e"), find)

    assert result.text == "b  c  e"
    assert [one.message for one in result.compilation.diagnostics] == ["c"]


def test_long_program() -> None:
    """Thousands of cures take one round, not one each."""
    rounds = []

    def counted(source: Source) -> Compilation:
        rounds.append(source)
        return translate(source)

    statements = "OPEN ARM_1\nGRASP\n" * 1000
    result = apply_fixes(Source("t.rlo", f"BEGIN\n{statements}END."), counted)

    assert len(result.applied) == 1999
    assert len(rounds) == 2


def test_one_vain_change_among_thousands() -> None:
    """One change in vain costs a few translations more, not one for each of the others."""
    rounds = []

    def counted(source: Source) -> Compilation:
        rounds.append(source)
        return translate(source)

    # The commas cure what they are for; the parenthesis shows that END is missing too.
    result = apply_fixes(Source("t.rlo", "BEGIN PRINT(" + '""' * 500), counted)

    assert len(result.applied) == 499
    assert len(rounds) < 50


@pytest.mark.parametrize(
    "text",
    [
        "VAR f : FRAME ; BEGIN MOVE ARM_1 ; READ VISIONS (f) END.",
        "VAR f : FRAME ; BEGIN MOVE ARM_1, ARM_2 TO f END.",
        "VAR f : FRAME ; BEGIN MOVE f * XYZ(0,0,1) TO f END.",
        "VAR n : SCALAR ; BEGIN n(1, 2, 3) END.",
        "BEGIN PAUS 3 END.",
    ],
)
def test_no_half_cures(text: str) -> None:
    """Where more is wrong than what could be put in, nothing is offered."""
    assert not any(one.fixes for one in translate(Source("t.rlo", text)).diagnostics)


@pytest.mark.parametrize(
    ("text", "cured"),
    [
        ("BEGIN PRINT(“seated”) END.", 'BEGIN PRINT("seated") END.'),
        ("BEGIN PRINT('seated', 1) END.", 'BEGIN PRINT("seated", 1) END.'),
        ("BEGIN COBEGIN BEGIN HALT END END ; HALT END.", "BEGIN COBEGIN BEGIN HALT END COEND ; HALT END."),
    ],
)
def test_habits_of_other_languages(text: str, cured: str) -> None:
    """Quotation marks of other languages, and END for COEND, are certain enough to be cured."""
    assert cure(text).text == cured
