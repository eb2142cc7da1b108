"""What an editor may ask about a program, put to the plain functions: also of programs that are half written."""

import random
from pathlib import Path

import attrs
import pytest
from lsprotocol import types as lsp

from armwright.errors import InvalidValueError
from armwright.program import KnownCell, Source, compile as translate
from armwright.program.api import analyse_flow
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import TextEdit, apply_edits
from armwright.program.language.words import VALUES, VOCABULARIES, WORDS_IN_CONTEXT, Standard
from armwright.program.language_server.analysis import Analysis, Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.code_actions import all_fixes, quick_fixes
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.language_server.inlay_hints import inlay_hints
from armwright.program.language_server.keyword_docs import WORDS, word_doc
from armwright.program.language_server.outline import document_symbols, folding_ranges
from armwright.program.language_server.positions import position, span_of, span_range
from armwright.program.language_server.rename import rename
from armwright.program.language_server.semantic_tokens import encode, line_tokens, token_edit
from armwright.program.language_server.signature_help import signature_help
from armwright.program.language_server.symbol_index import NameKind
from armwright.program.semantics.builtins import FUNCTIONS
from program.shelf import ACCEPTED, CORPUS

STANFORD = CORPUS / "cell1.json"


def analysis_of(text: str, *, cell: Path | None = None, std: Standard = Standard.RLO_2) -> Analysis:
    """Return what is known of a program."""
    return analyse("test.rlo", PositionCodec(text), None, CellCache(), Settings(cell=cell, std=std))


def labels(text: str, **how: Standard) -> list[str]:
    """Return what can be written where a bar stands in a text."""
    offset = text.index("|")
    text = text.replace("|", "")
    return [one.label for one in completions(PositionCodec(text), analysis_of(text, **how), offset, snippets=True)]


# ---- words ---------------------------------------------------------------------------------------------------------


def test_every_word_is_explained() -> None:
    """Each word of the language and each function has a sentence, in the statements where it stands."""
    for word in (*VOCABULARIES[Standard.RLO_2].reserved, *FUNCTIONS, *VALUES, *WORDS_IN_CONTEXT):
        meaning = word_doc(word)
        assert meaning is not None, word
        assert word in meaning.syntax
        assert meaning.text.endswith(".")
    in_context = {"VISIONS", "SYSTEM", "ZERO FORCE", *WORDS_IN_CONTEXT}
    assert set(WORDS) <= VOCABULARIES[Standard.RLO_2].reserved | set(FUNCTIONS) | VALUES | in_context


@pytest.mark.parametrize(
    ("statement", "form"),
    [
        ("AFFIX f |TO ARM_1", "AFFIX frame"),
        ("MOVE f |TO g", "MOVE frame"),
        ("OPEN ARM_1 |TO 5", "OPEN arm"),
        ("FOR n = 1 |TO 5 DO HALT", "FOR variable"),
        ("OPERATE lamp |ON", "OPERATE device"),
        ("MOVE f TO g |ON n > 1 DO HALT", "ON condition"),
    ],
)
def test_word_with_several_meanings(statement: str, form: str) -> None:
    """TO and ON mean what they mean in their statement."""
    text = f"VAR f, g : FRAME ; n : SCALAR ; BEGIN {statement} ; END."
    found = hover(analysis_of(text.replace("|", "")), text.index("|"), markdown=False)

    assert found is not None
    assert isinstance(found.contents, lsp.MarkupContent)
    assert found.contents.value.startswith(form)


def test_names_that_are_variables_only_sometimes() -> None:
    """X is an axis in FORCE and a variable elsewhere; MM a unit in UNITS; what OPERATE names is a device."""
    text = (
        "UNITS MM ; VAR X, mm, lamp : SCALAR ; f : FRAME ; BEGIN\n"
        "READ VISIONS (f) ; OPERATE lamp ; X = FORCE(X) + mm * lamp ; END."
    )
    found = [(one.key, one.kind, one.writes) for one in analysis_of(text).occurrences if not one.declares]

    assert found == [
        ("MM", NameKind.UNIT, False),
        ("VISIONS", NameKind.SENSOR, False),
        ("F", NameKind.VARIABLE, True),
        ("LAMP", NameKind.DEVICE, False),
        ("X", NameKind.VARIABLE, True),
        ("FORCE", NameKind.FUNCTION, False),
        ("X", NameKind.AXIS, False),
        ("MM", NameKind.VARIABLE, False),
        ("LAMP", NameKind.VARIABLE, False),
    ]


def test_names_that_are_words_together() -> None:
    """ZERO and FORCE are names of variables, but start a statement together; TORQUE(X) has an axis, as FORCE has."""
    text = "VAR zero, x : SCALAR ; BEGIN zero = TORQUE(x) ; ZERO { tare } FORCE ARM_1 ; x = zero END."
    found = [(one.key, one.kind, one.writes) for one in analysis_of(text).occurrences if not one.declares]

    assert found == [
        ("ZERO", NameKind.VARIABLE, True),
        ("TORQUE", NameKind.FUNCTION, False),
        ("X", NameKind.AXIS, False),
        ("ZERO FORCE", NameKind.SENSOR, False),
        ("ZERO FORCE", NameKind.SENSOR, False),
        ("ARM_1", NameKind.ARM, False),
        ("X", NameKind.VARIABLE, True),
        ("ZERO", NameKind.VARIABLE, False),
    ]
    for word in ("ZERO {", "FORCE"):
        shown = hover(analysis_of(text), text.index(word), markdown=False)
        assert shown is not None
        assert isinstance(shown.contents, lsp.MarkupContent)
        assert shown.contents.value.startswith("ZERO FORCE arm")


# ---- completion ----------------------------------------------------------------------------------------------------

HEAD = (
    "VAR f, g : FRAME ; n : SCALAR ; t : TRANS ; e : EVENT ; parts : ARRAY [3] OF FRAME ;"
    "PROCEDURE put (a : FRAME, b : SCALAR) ; BEGIN n = b ; MOVE ARM_1 TO a END ; BEGIN "
)


@pytest.mark.parametrize(
    ("written", "first"),
    [
        ("AFFIX |", ["f", "g", "parts"]),
        ("AFFIX f |", ["TO"]),
        ("AFFIX f TO |", ["ARM_1", "f", "g"]),
        ("AFFIX f TO g |", ["AT", "RIGIDLY", "NONRIGIDLY"]),
        ("AFFIX f TO g AT |", ["t", "XYZ", "ROTX"]),
        ("UNFIX f |", ["FROM"]),
        ("OPEN |", ["ARM_1"]),
        ("GRASP |", ["ARM_1"]),
        ("READ |", ["VISIONS", "SYSTEM"]),
        ("READ VISIONS (|", ["f", "g", "parts"]),
        ("READ SYSTEM (|", ["ARM_1"]),
        ("SIGNAL |", ["e"]),
        ("WAIT |", ["e"]),
        ("IF n > 1 |", ["AND", "OR", "THEN"]),
        ("IF n > 1 THEN OPEN ARM_1 |", ["TO", "ELSE"]),
        ("WHILE |", ["n", "DIST", "FORCE", "TORQUE"]),
        ("FOR n = 1 TO 3 |", ["STEP", "DO"]),
        ("put (|", ["ARM_1", "f", "g", "parts"]),
        ("put (f, |", ["n", "DIST", "FORCE", "TORQUE"]),
        ("t = XYZ(0, 0, |", ["n", "DIST", "FORCE", "TORQUE"]),
        ("n = FORCE(|", ["X", "Y", "Z"]),
        ("n = TORQUE(|", ["X", "Y", "Z"]),
        ("ZERO FORCE |", ["ARM_1"]),
        ("f = g * |", ["ARM_1", "f", "g"]),
        ("n = parts[|", ["n"]),
        ("MOVE f TO g VIA (|", ["ARM_1", "f", "g"]),
        ("MOVE f TO g, |", ["DIRECTLY", "STRAIGHTLY", "VIA", "ON"]),
        ("MOVE f TO g ON n > 1 DO HALT, |", ["DIRECTLY", "STRAIGHTLY", "VIA", "ON"]),
        ("MOVE f TO g WITH APPROACH = |", ["ARM_1", "f", "g"]),
        ("MOVE f TO g STRAIGHTLY |", ["ON", "SMOOTHLY", "WITH SPEED", "WITH BLEND", "WITH DURATION"]),
        ("MOVE f TO g | WITH DURATION = 3s", ["DIRECTLY", "STRAIGHTLY", "VIA", "ON", "CIRCULARLY", "SMOOTHLY"]),
        ("MOVE f TO g ON n > 1 DO |", ["HALT", "SIGNAL", "PRINT", "BEGIN"]),
        ("MOVE f TO g ON n > 1 |", ["AND", "OR", "DO"]),
        ("f = (1, |", ["n", "DIST", "FORCE", "TORQUE"]),
        ("COBEGIN PRIORITY 2 : |", ["BEGIN"]),
        ("n = 1 |", []),
        ("MOVE f VIA |", []),
        ("OPEN ARM_1 ; // MOVE |", []),
        ('PRINT ("MOVE |', []),
    ],
)
def test_completion(written: str, first: list[str]) -> None:
    """What is offered first is what may stand there."""
    found = labels(f"{HEAD}{written} ; END.")

    assert found[: len(first)] == first
    assert first or not found


@pytest.mark.parametrize(
    ("known", "since", "first"),
    [
        ("", "MOVE ", ["ARM_1", "f", "g"]),
        ("MO", "VE ", ["ARM_1", "f", "g"]),
        ("MOVE f", " TO g, ", ["DIRECTLY", "STRAIGHTLY", "VIA", "ON"]),
        ("", "n = 1 ; put (f, ", ["n", "DIST", "FORCE", "TORQUE"]),
        ("", "TRY n = 1 RECOVER WAIT ", ["e"]),
        ("", "{ 1 } MOVE ", ["ARM_1", "f", "g"]),
        ("", "{ MOVE ", []),
        ("", "// MOVE ", []),
        ("", 'PRINT ("MOVE ', []),
    ],
)
def test_completion_of_what_is_not_looked_at_yet(known: str, since: str, first: list[str]) -> None:
    """What was written since the program was last looked at as a whole counts for what may stand behind it."""
    text, place = f"{HEAD}{known}{since} ; END.", len(HEAD) + len(known) + len(since)

    analysis = analysis_of(f"{HEAD}{known} ; END.")
    found = [one.label for one in completions(PositionCodec(text), analysis, place, snippets=True)]
    assert found[: len(first)] == first
    assert first or not found


def test_completion_in_front_of_begin() -> None:
    """In front of BEGIN stand declarations, behind a colon types; none of it is of RLO-2 in RLO-83."""
    assert labels("VAR f : |") == ["SCALAR", "TRANS", "FRAME", "EVENT", "BOOLEAN", "TEXT", "ARRAY"]
    assert labels("VAR f : |", std=Standard.RLO_83) == ["SCALAR", "TRANS", "FRAME"]
    assert labels("|", std=Standard.RLO_83)[0] == "VAR"
    assert "IMPORT" not in labels("|", std=Standard.RLO_83)
    assert "MOVE" not in labels("VAR f : FRAME ; |")
    assert labels("UNITS |")[:2] == ["MM", "CM"]
    assert "WHILE" not in labels("BEGIN |", std=Standard.RLO_83)
    assert labels("VAR t : TRANS ; f : FRAME ; BEGIN AFFIX f TO f AT |", std=Standard.RLO_83) == ["t"]


def test_completion_of_words_that_end_statements() -> None:
    """What ends statements is offered where the next one begins, and behind one when it is being written."""
    assert "END" in labels(f"{HEAD}n = 1 ; |")
    assert labels(f"{HEAD}n = 1 E|") == ["END"]
    assert "UNTIL" in labels(f"{HEAD}REPEAT n = 1 ; |")
    assert "RETRY" in labels(f"{HEAD}TRY n = 1 RECOVER IF n > 1 THEN BEGIN |")
    assert "RETRY" not in labels(f"{HEAD}TRY |")


def test_completion_keeps_the_case_of_the_program() -> None:
    """A program in lower case is offered words in lower case."""
    assert labels("var f : frame ; begin move f |") == ["to"]


def test_completion_in_a_procedure() -> None:
    """In a procedure its own names come first; elsewhere they are not known."""
    text = "VAR f : FRAME ; PROCEDURE p (a : FRAME) ; BEGIN AFFIX | END ; BEGIN p (f) END."

    assert labels(text)[:2] == ["a", "f"]
    assert "a" not in labels(text.replace("|", "f TO a ;").replace("BEGIN p (f)", "BEGIN AFFIX |"))


# ---- names ---------------------------------------------------------------------------------------------------------

SCOPES = (
    "VAR a, b : SCALAR ; PROCEDURE p (a : SCALAR) ; VAR c : SCALAR ; BEGIN c = a ; b = c END ; "
    "BEGIN a = 1 ; p (a) ; PRINT (a, b) END."
)


@pytest.mark.parametrize(
    ("place", "new", "message"),
    [
        ("c : SCALAR", "b", "uses the 'b' of the program"),
        ("b : SCALAR", "c", "procedure `p` has a 'c' of its own"),
        ("a, b", "p", "the program already has a name 'p'"),
        ("p (a :", "b", "the program already has a name 'b'"),
        ("p (a :", "XYZ", "'XYZ' is a function"),
        ("a, b", "World", "'World' is a frame that is predeclared"),
        ("c : SCALAR", "Station", "'Station' is a frame that is predeclared"),
        ("a, b", "1a", "'1a' is no name"),
        ("VAR", "x", "`VAR` is no name"),
    ],
)
def test_rename_that_would_change_the_meaning(place: str, new: str, message: str) -> None:
    """A name that would mean something else somewhere is refused."""
    with pytest.raises(InvalidValueError) as error:
        rename(analysis_of(SCOPES), SCOPES.index(place), new)

    assert message in str(error.value)


def test_rename_keeps_the_code() -> None:
    """A program whose names were all changed does the same."""
    text = SCOPES
    for old, new in (("a, b", "first"), ("b : SCALAR", "second"), ("c : SCALAR", "third"), ("p (", "act")):
        analysis = analysis_of(text)
        text = apply_edits(text, rename(analysis, text.index(old.replace("a, b", ", ") if old == "a, b" else old), new))
    before, after = (translate(Source("test.rlo", program)).code for program in (SCOPES, text))

    assert before is not None
    assert after is not None
    assert [step.op for step in before.instructions] == [step.op for step in after.instructions]
    assert "first = 1 ; act (first)" in text


def test_analysis_has_all_diagnostics() -> None:
    """A program that is analysed in two steps has the diagnostics of the compiled program, and no intermediate code."""
    for path in ACCEPTED:
        source = Source(path.name, path.read_text())
        analysed = analyse_flow(translate(source, names_only=True))

        assert analysed.code is None
        assert analysed.diagnostics == translate(source).diagnostics


def test_names_of_rlo_83_are_short() -> None:
    """RLO-83 has names of nine characters, and words of RLO-2 are free there."""
    text = "VAR f : FRAME ; BEGIN READ VISIONS (f) ; END."
    analysis = analysis_of(text, std=Standard.RLO_83)

    assert apply_edits(text, rename(analysis, 4, "while")) == text.replace("f :", "while :").replace("(f)", "(while)")
    with pytest.raises(InvalidValueError, match="at most 9 characters in RLO-83"):
        rename(analysis, 4, "x" * 10)


# ---- colours -------------------------------------------------------------------------------------------------------


def test_colours_that_are_sent_again() -> None:
    """What is sent after a change makes the colours of the new text out of those of the old one."""
    chance = random.Random(7)
    for path in ACCEPTED:
        text = path.read_text(encoding="utf-8")
        at = chance.randrange(len(text))
        changed = text[:at] + chance.choice([" ", "7", ";", "\n", "{"]) + text[at:]
        old, new = (line_tokens(analysis_of(one)) for one in (text, changed))
        start, gone, come = token_edit(old, new)
        numbers = encode(old)
        numbers[start : start + gone] = come
        assert numbers == encode(new)


# ---- anything ------------------------------------------------------------------------------------------------------

PIECES = (
    *("MOVE ", "TO ", "WITH ", "APPROACH = ", "BEGIN ", "END ", ";", "(", ")", "[", "]", ",", "=", "*", "-", "{", "}"),
    *("//", '"', "ARM_1", "arm-", "f", "PROCEDURE ", "VAR ", ":", "FRAME", "IF ", "THEN ", "ON ", "DO ", "\r\n", "\n"),
    *("🤖", "é", "\u2028", "\ufeff", "100 ", "25mm", "1e", ".", "COBEGIN ", "TRY ", "RECOVER ", "\x00", "UNITS "),
)


@pytest.mark.parametrize(
    ("line", "title"),
    [
        ("MVOE ARM_1 TO part", "replace `MVOE` by `MOVE`"),
        ("MOVE ARM_1 TO pratt", "replace `pratt` by `part`"),
        ("MOVE ARM_1 TO part WITH SPED = 5", "replace `SPED` by `SPEED`"),
        ("MOVE ARM_1 TO fedeer", "replace `fedeer` by `FEEDER`"),
    ],
)
def test_words_that_were_meant(line: str, title: str) -> None:
    """What a message asks for by "did you mean" is offered as a fix, and is none of those made all at once."""
    text = f"VAR part : FRAME ;\nBEGIN\n  READ VISIONS (part) ;\n  {line} ;\nEND.\n"
    cell = KnownCell(arms=frozenset({"ARM_1"}), frames={"FEEDER": "WORLD"})
    analysis = attrs.evolve(analysis_of(text), compiled=translate(Source("t.rlo", text), cell))
    [fix] = quick_fixes(analysis, "t.rlo", span_range(analysis.codec, Span(0, len(text))), ())

    assert fix.title == title
    assert not fix.is_preferred
    assert fix.edit is not None
    assert fix.edit.changes is not None
    [edit] = fix.edit.changes["t.rlo"]
    changed = apply_edits(text, (TextEdit(span_of(analysis.codec, edit.range), edit.new_text),))
    mended = translate(Source("t.rlo", changed), cell)
    assert edit.new_text in mended.source.text
    assert {one.code for one in mended.diagnostics} <= {"E202"}
    assert all_fixes(analysis.compiled.diagnostics) == ()


def ask_everything(analysis: Analysis, text: str, offset: int, new: str) -> None:
    """Ask all questions at one place; each gives a sensible answer."""
    codec = PositionCodec(text)
    for one in completions(codec, analysis, offset, snippets=True):
        assert isinstance(one.text_edit, lsp.TextEdit)
        word = span_of(codec, one.text_edit.range)
        assert word.start <= offset == word.end
    for signature in getattr(signature_help(text, analysis, offset), "signatures", ()):
        assert all(one.label[0] < one.label[1] <= len(signature.label) for one in signature.parameters)
    assert len(line_tokens(analysis)) == len(analysis.codec.line_starts)
    place = min(offset, len(analysis.text))
    where = position(analysis.codec, place)
    found = hover(analysis, place, markdown=True)
    assert found is None or (found.range is not None and found.range.start <= where <= found.range.end)
    whole = span_range(analysis.codec, Span(0, len(analysis.text)))
    for hint in inlay_hints(analysis, whole):
        assert whole.start <= hint.position <= whole.end
    for symbol in document_symbols(analysis):
        name = symbol.selection_range
        assert symbol.range.start <= name.start <= name.end <= symbol.range.end
    assert all(
        0 <= fold.start_line < fold.end_line < len(analysis.codec.line_starts) for fold in folding_ranges(analysis)
    )
    quick_fixes(analysis, "test.rlo", lsp.Range(where, where), ())
    apply_edits(analysis.text, all_fixes(analysis.compiled.diagnostics))
    try:
        rename(analysis, place, new)
    except InvalidValueError as error:
        assert str(error)  # noqa: PT017 - refusing is one of two right answers


@pytest.mark.parametrize("seed", range(30))
def test_any_text_gets_an_answer(seed: int) -> None:
    """Programs changed at random, again and again, answer all questions: known as they are, or as they were."""
    chance = random.Random(seed)
    path = chance.choice([*ACCEPTED, *CORPUS.glob("*.rlo")])
    text = path.read_text(encoding="utf-8")
    std = chance.choice([*Standard])
    analysis = analysis_of(text, cell=chance.choice([None, STANFORD]), std=std)
    for _ in range(12):
        start = chance.randrange(len(text) + 1)
        end = min(len(text), start + chance.choice([0, 0, 0, 1, 3, 40]))
        text = text[:start] + "".join(chance.choices(PIECES, k=chance.randrange(4))) + text[end:]
        place = chance.choice([start, chance.randrange(len(text) + 1)])
        # A cursor is never within a line end.
        place += text[max(0, place - 1) : place + 1] == "\r\n"
        ask_everything(analysis, text, place, "other")
        if chance.random() < 0.4:
            analysis = analysis_of(text, std=std)
            ask_everything(analysis, text, place, "f")
