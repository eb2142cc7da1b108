"""Programs laid out: what they say stays, and how it was written before does not matter."""

import random
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import attrs
import pytest
from hypothesis import given, strategies as st
from lark import Lark

from armwright.errors import InvalidValueError
from armwright.program.formatter.format import WIDTH, UnformattableError, formatted
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import ScannedText, scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse
from program.sentences import IN_CONTEXT, Sentences, mutants
from program.shelf import ACCEPTED, CORPUS, OLD, REJECTED
from samples import Sample

GRAMMAR = Lark((CORPUS / "rlo.lark").read_text(), maybe_placeholders=False)
WORDS = {
    "ARM": ("ARM_1", "arm-2", "ARM_07"),
    "NAME": ("f", "G", "peg_1", "Dist", "visions"),
    "NUMBER": ("1", "0.50", "12e-1", "7mm", "90DEG", "300000000"),
    "STRING": ('"a  {b} // c"', '""'),
    "VISIONS": ("VISIONS", "visions"),
    "ZERO": ("zero",),
    "FORCE": ("Force",),
    "UNITNAME": ("mm", "DEG"),
    **IN_CONTEXT,
    "DOTTED": ("grip.take", "Slot.Left"),
    "RELOP": ("<", "<=", "<>", ">=", ">"),
    "ADDOP": ("+", "-"),
    "MULOP": ("*", "/"),
    "RIGIDITY": ("RIGIDLY", "NonRigidly"),
    "ONOFF": ("ON", "off"),
    "WITHKEY": ("APPROACH", "Departure", "SPEED", "BLEND", "DURATION"),
}
SENTENCES = 1000


def is_right(path: Path) -> bool:
    """Whether the syntax of a program is right."""
    try:
        layout(path.read_text(encoding="utf-8"), standard_of(path))
    except UnformattableError:
        return False
    return True


def standard_of(path: Path) -> Standard:
    return Standard.RLO_83 if OLD.search(path.read_text(encoding="utf-8")) else Standard.RLO_2


def layout(text: str, std: Standard = Standard.RLO_2, numbers: int | None = None, width: int = WIDTH) -> str:
    return formatted(Source("t.rlo", text), std=std, numbers=numbers, width=width)


def body(text: str, **options: int) -> list[str]:
    """Lay out statements; return their lines, without the indent of the program."""
    lines = layout(f"BEGIN {text} END.", **options).splitlines()
    assert (lines[0], lines[-1]) == ("BEGIN", "END.")
    return [line.removeprefix("  ") for line in lines[1:-1]]


CORPUS_PROGRAMS = sorted(CORPUS.glob("*.rlo"))
RIGHT = [path for path in (*CORPUS_PROGRAMS, *ACCEPTED, *REJECTED) if is_right(path)]
NAMES = [f"{path.parent.name}/{path.stem}" for path in RIGHT]


def scanned(text: str, std: Standard) -> tuple[str, ScannedText]:
    source = Source("t.rlo", text)
    bare, _ = blank_line_numbers(source)
    return bare, scan(source, bare, std)


def meaning(text: str, std: Standard) -> object:
    """Return the tree of a program as plain data: without places, names as they are compared."""
    _, words = scanned(text, std)
    program, slips = parse(Source("t.rlo", text), words.tokens, std)
    assert {slip.code for slip in slips} <= {"E103", "E205", "E250"}, slips
    return plain(program)


def plain(node: object) -> object:
    if isinstance(node, tuple):
        return [plain(one) for one in node]
    if not attrs.has(type(node)):
        return node
    spelt = isinstance(node, tree.Name | tree.ArmName | tree.TypeName)
    fields = {
        field.name: plain(getattr(node, field.name))
        for field in attrs.fields(type(node))
        if not (isinstance(getattr(node, field.name), Span) or (spelt and field.name == "text"))
    }
    return type(node).__name__, fields


def comments(text: str, std: Standard) -> list[str]:
    """Return the comments of a program, blanks and line ends in them as one blank."""
    bare, words = scanned(text, std)
    return [" ".join(bare[one.start : one.end].split()) for one in words.comments]


def check_kept(text: str, std: Standard = Standard.RLO_2, numbers: int | None = None, width: int = WIDTH) -> str:
    """Lay out a program and check that nothing is lost and that it is laid out for good; return it."""
    after = layout(text, std, numbers, width)
    assert meaning(after, std) == meaning(text, std)
    assert comments(after, std) == comments(text, std)
    assert layout(after, std, numbers, width) == after
    assert not re.search(r"[ \t]$", after, re.MULTILINE)
    return after


@pytest.mark.parametrize("path", RIGHT, ids=NAMES)
@pytest.mark.drawn(0.4)
def test_nothing_is_lost(path: Path) -> None:
    """A program on the shelf says the same when laid out, keeps its comments, and is laid out once and for all."""
    text, std = path.read_text(encoding="utf-8"), standard_of(path)
    for width in (WIDTH, 40, 1):
        after = check_kept(text, std, width=width)
        assert layout(check_kept(text, std, numbers=100, width=width), std, width=width) == after


@pytest.mark.parametrize("name", [f"p0{number}" for number in range(1, 9)])
def test_conformance_programs(name: str) -> None:
    """The conformance programs, laid out by hand, differ from what they should be in blanks and lines of a MOVE."""
    before = (CORPUS / f"{name}.rlo").read_text()
    bare, _ = blank_line_numbers(Source(name, before))
    after = layout(before)
    indents = [
        [len(line) - len(line.lstrip()) for line in text.rstrip().split("\n") if re.search(r"^ *(END|BEGIN|FOR)", line)]
        for text in (bare, after)
    ]
    assert "".join(after.split()).upper().replace("ARM-", "ARM_") == "".join(bare.split()).upper().replace(
        "ARM-", "ARM_"
    )
    if name > "p02":
        assert indents[0] == indents[1]


def spaced(text: str, std: Standard, chance: random.Random) -> str:
    """Put the words of a program together with other blanks and line ends, and letters in other cases."""
    bare, words = scanned(text, std)
    pieces = []
    for token, following in zip(words.tokens, words.tokens[1:], strict=False):
        written = bare[token.start : token.end]
        pieces.append(
            written if written.startswith('"') else chance.choice((written, written.lower(), written.upper()))
        )
        apart = written[-1].isalnum() and following.text[:1].isalnum()
        # Digits at the start of a line could be taken for its number where the first line begins with some.
        pieces.append(chance.choice((" ", "\n", "\t ", "\r\n") if apart else ("", " ", "\n  ", "\r")))
    return "".join(pieces)


def without_spelling(text: str) -> str:
    """Fold the case of letters: names keep the case in which they are declared, which re-spacing changes."""
    return text.upper()


@pytest.mark.parametrize("path", [path for path in RIGHT if path not in REJECTED], ids=lambda path: path.stem)
@pytest.mark.drawn(0.4)
def test_layout_does_not_matter(path: Path) -> None:
    """The words of a program determine how it is laid out: blanks, line ends and case do not matter."""
    text, std = path.read_text(encoding="utf-8"), standard_of(path)
    chance = random.Random(len(text))
    first, *others = [layout(spaced(text, std, chance), std) for _ in range(4)]
    assert [without_spelling(other) for other in others] == [without_spelling(first)] * 3


def test_sentences(sample: Sample) -> None:
    """Every sentence of the grammar can be laid out, however long or deep, and says the same afterwards."""
    chance, count = random.Random(sample.seed), sample.count(SENTENCES)
    for words, _ in zip(Sentences(GRAMMAR, WORDS, seed=sample.seed), range(count), strict=False):
        text = " ".join(words)
        after = check_kept(text, width=chance.choice((WIDTH, 30)))
        assert (
            layout(spaced(text, Standard.RLO_2, random.Random(1)).upper(), width=200).upper()
            == layout(after, width=200).upper()
        )
    sample.record("sentences of the grammar laid out", count, 0)


def test_damaged_sentences(sample: Sample) -> None:
    """A sentence with one slip is refused, or is a program as well and keeps what it says."""
    accepted, count = 0, sample.count(SENTENCES)
    for seed, (words, _) in enumerate(zip(Sentences(GRAMMAR, WORDS, seed=sample.seed), range(count), strict=False)):
        for mutant in mutants(words, 6, sample.seed + seed):
            with suppress(UnformattableError):
                check_kept(" ".join(mutant))
                accepted += 1
    sample.record("damaged sentences, six slips each, laid out or refused", 6 * count, 0)
    assert accepted > count / 4


def with_comments(words: list[str], chance: random.Random) -> Iterator[str]:
    kinds = (
        "",
        " ",
        "\n",
        "\n\n\n",
        " { c }",
        " // to the end\n",
        "\n{ on its own }\n",
        " {two\n    lines} ",
        "\n\n// d\n\n",
    )
    for number, word in enumerate(words):
        yield word
        comment = chance.choice(kinds) if chance.random() < 0.5 else " "
        yield f" {comment} ".replace("c }", f"c{number} }}").replace("// ", f"// {number} ")


def test_comments_anywhere(sample: Sample) -> None:
    """Comments of every kind may stand between any two words: all stay, in order, and stay where they are."""
    count = sample.count(SENTENCES)
    for seed, (words, _) in enumerate(zip(Sentences(GRAMMAR, WORDS, seed=sample.seed), range(count), strict=False)):
        text = "".join(with_comments(words, random.Random(sample.seed + seed)))
        check_kept(text, width=(WIDTH, 30)[seed % 2])
        check_kept(text, numbers=10)
    sample.record("sentences with comments between any words laid out", count, 0)


def test_indents() -> None:
    """Statements within others are two blanks further in; BEGIN, ELSE and END stand below what they belong to."""
    text = (
        "if n=1 then halt else if n=2 then begin halt end else while n<3 do repeat n=n+1; until n>3;"
        "try retry recover lock(f,g)do begin end end;"
        "cobegin begin open arm-1 end; priority 2:begin end; coend; begin end"
    )
    assert body(text) == [
        "IF n = 1 THEN",
        "  HALT",
        "ELSE IF n = 2 THEN",
        "BEGIN",
        "  HALT",
        "END",
        "ELSE",
        "  WHILE n < 3 DO",
        "    REPEAT",
        "      n = n + 1 ;",
        "    UNTIL n > 3 ;",
        "TRY",
        "  RETRY",
        "RECOVER",
        "  LOCK (f, g) DO",
        "  BEGIN",
        "  END",
        "END ;",
        "COBEGIN",
        "  BEGIN",
        "    OPEN ARM_1",
        "  END ;",
        "  PRIORITY 2 : BEGIN",
        "  END ;",
        "COEND ;",
        "BEGIN",
        "END",
    ]


def test_headers() -> None:
    """Declarations stand one below the other, procedures at the margin."""
    text = (
        'import "cell.json";units mm,deg;var a,b:frame;c:array[2,3]of scalar;var d:event;'
        "procedure p(x,y:frame,n:array[4]of trans);var i:scalar;j:trans;begin halt end;procedure q;begin end;begin end."
    )
    assert layout(text).splitlines() == [
        'IMPORT "cell.json" ;',
        "UNITS MM, DEG ;",
        "VAR a, b : FRAME ;",
        "    c : ARRAY [2,3] OF SCALAR ;",
        "VAR d : EVENT ;",
        "PROCEDURE p(x, y : FRAME, n : ARRAY [4] OF TRANS) ;",
        "VAR i : SCALAR ;",
        "    j : TRANS ;",
        "BEGIN",
        "  HALT",
        "END ;",
        "PROCEDURE q ;",
        "BEGIN",
        "END ;",
        "BEGIN",
        "END.",
    ]


@pytest.mark.parametrize(
    ("written", "laid_out"),
    [
        ("n=-1+2*a[i-1,j]", "n = -1 + 2 * a[i-1,j]"),
        ("n=-(a+b)*-c", "n = -(a+b) * -c"),
        ("p((a- -1)*2,-b)", "p((a - -1)*2, -b)"),
        ("f=(1,0,0,0,1,0,0,0,1,n,n+1,- 2)", "f = (1,0,0, 0,1,0, 0,0,1, n,n+1,-2)"),
        ("f=((1),2)", "f = ((1), 2)"),
        ('print ( "a;b" ,not(a=1 and b>=2))', 'PRINT("a;b", NOT (a = 1 AND b >= 2))'),
        ("read visions(f,visions);read system(arm-1)", "READ VISIONS (f, visions) ;|READ SYSTEM (ARM_1)"),
        ("n=dist(f,arm-01)/force(z)", "n = DIST(f, ARM_1) / FORCE(Z)"),
        ("zero force arm-01;n=torque(y)", "ZERO FORCE ARM_1 ;|n = TORQUE(Y)"),
        ("operate Torch off;unfix f;grasp arm_2", "OPERATE Torch OFF ;|UNFIX f ;|GRASP ARM_2"),
        ("for i=3 to 1 step-1 do signal e[i]", "FOR i = 3 TO 1 STEP -1 DO|  SIGNAL e[i]"),
        ("move f to g,via(a,b)with blend=5MM", "MOVE f TO g VIA (a, b), WITH BLEND = 5MM"),
        ("move f to g on force(x)>1.50E1 do begin n=1;end", "MOVE f TO g ON FORCE(X) > 1.50E1 DO BEGIN n = 1 ; END"),
        ("affix f to g at(t)rigidly", "AFFIX f TO g AT (t) RIGIDLY"),
        (";;halt;;;;pause 300ms;", "HALT ;|PAUSE 300ms ;"),
    ],
)
def test_blanks(written: str, laid_out: str) -> None:
    """Blanks stand between words and around operations, but not within parentheses; numbers stay as written."""
    assert body(written) == laid_out.split("|")


def test_spelling() -> None:
    """A name is spelt as where it is declared, in a procedure as the procedure declares it; others stay."""
    text = (
        "VAR Peg : FRAME ; PROCEDURE Work(peg : FRAME) ; VAR I : SCALAR ; BEGIN i = 1 ; MOVE PEG TO HOME END ;"
        "BEGIN work(pEG) ; peg = Station ; OPERATE peg END."
    )
    assert layout(text).splitlines()[4:] == [
        "  I = 1 ;",
        "  MOVE peg TO HOME",
        "END ;",
        "BEGIN",
        "  Work(Peg) ;",
        "  Peg = Station ;",
        "  OPERATE peg",
        "END.",
    ]


def test_old_names() -> None:
    """What RLO-2 reserves is a name in RLO-83, and stays one."""
    text = "var on, If : frame; begin move arm-1 to ON via(if) end."
    expected = ["VAR on, If : FRAME ;", "BEGIN", "  MOVE ARM_1 TO on VIA (If)", "END."]
    assert layout(text, Standard.RLO_83).splitlines() == expected


def test_long_motion() -> None:
    """A MOVE that is longer than a line has a line for each clause."""
    text = "MOVE f TO g WITH SPEED = 5, ON n > 1 DO HALT, VIA (a, b)"
    assert body(text, width=2 + len(text)) == [text]
    assert body(text, width=1 + len(text)) == [
        "MOVE f TO g WITH SPEED = 5,",
        "     ON n > 1 DO HALT,",
        "     VIA (a, b)",
    ]


def test_guard_with_rows_of_its_own() -> None:
    """A block behind ON takes lines of its own when it is long, holds large statements or has comments."""
    long = "n = 1 ; " * 8
    for inside in (f"{long}HALT", "MOVE f TO g", "IF n > 1 THEN HALT", "HALT { stop }"):
        lines = body(f"MOVE f TO g ON n > 1 DO BEGIN {inside} END WITH SPEED = 5, VIA (a) ;")
        assert lines[:2] == ["MOVE f TO g ON n > 1 DO", "     BEGIN"]
        assert lines[-3:] == ["     END,", "     WITH SPEED = 5,", "     VIA (a) ;"]
        assert lines[2].startswith("       ")


def test_long_lines() -> None:
    """Lists break behind commas and go on below their parenthesis; matrices break by triples, sums before a sign."""
    assert body("f = (1,0,0,0,1,0,0,0,1,100,200,300)", width=36) == ["f = (1,0,0, 0,1,0, 0,0,1,", "     100,200,300)"]
    assert body("f = (1,0,0,0,1,0,0,0,1,aaaaaaaaaa,bbbbbbbbbb+1,c)", width=32) == [
        "f = (1,0,0, 0,1,0, 0,0,1,",
        "     aaaaaaaaaa,bbbbbbbbbb+1,",
        "     c)",
    ]
    assert body("n = aaaaaaa * bbbbbbb + ccccccc * ddddddd", width=30) == [
        "n = aaaaaaa * bbbbbbb",
        "    + ccccccc * ddddddd",
    ]
    assert body("AFFIX aaaaaaa TO bbbbbb AT XYZ(1, 2, 3)", width=30) == [
        "AFFIX aaaaaaa TO bbbbbb",
        "    AT XYZ(1, 2, 3)",
    ]
    names = ", ".join(f"name{number}" for number in range(12))
    assert layout(f"VAR {names} : FRAME ; x, {names} : TRANS ; BEGIN END.", width=50).splitlines()[:4] == [
        "VAR name0, name1, name2, name3, name4, name5,",
        "      name6, name7, name8, name9, name10,",
        "      name11 : FRAME ;",
        "    x, name0, name1, name2, name3, name4, name5,",
    ]


def test_no_line_is_too_long() -> None:
    """No line of the shelf is longer than it should be, but for comments and long texts."""
    for path in RIGHT:
        lines = layout(path.read_text(encoding="utf-8"), standard_of(path)).splitlines()
        assert all(len(line) <= WIDTH for line in lines if not re.search(r'[{}"]|//', line)), path


def test_comments_and_blank_lines() -> None:
    """Comments stay beside or above what they are about; of several blank lines one stays."""
    text = """

{ A program
    of two lines }
var f : frame ;   // a place


// above

BEGIN{ beside }
      { own }
  OPEN ARM_1 // not yet over
  ;  { next } GRASP ;


  f = (1,0,0, // n
       0,1,0,0,0,1 { o, a } ,0,0,0) ;
  MOVE f { what } TO g // where
    , WITH SPEED = 5 // slow
    VIA (g) ;
  IF n = 1 THEN // then
    HALT
    { else }
  ELSE // or
  IF n = 2 THEN HALT ;
  { last }
END { now } . { over }
// really

"""
    assert (
        check_kept(text)
        == """\
{ A program
    of two lines }
VAR f : FRAME ;  // a place

// above

BEGIN  { beside }
  { own }
  OPEN ARM_1 ;  // not yet over
  { next }
  GRASP ;

  f = (1,0,0, // n
       0,1,0, 0,0,1 { o, a }, 0,0,0) ;
  MOVE f { what } TO g // where
       WITH SPEED = 5, // slow
       VIA (g) ;
  IF n = 1 THEN  // then
    HALT
    { else }
  ELSE  // or
    IF n = 2 THEN
      HALT ;
  { last }
END { now }.  { over }
// really
"""
    )


def test_numbers() -> None:
    """Numbers of lines are dropped, or each line gets a new one, also those of comments and blank ones."""
    text = "10 VAR f : FRAME ; { one\n20   two }\n\n30 BEGIN OPEN ARM_1 ;\n\n40 GRASP END."
    plain_lines = [
        "VAR f : FRAME ;  { one",
        "                 two }",
        "",
        "BEGIN",
        "  OPEN ARM_1 ;",
        "",
        "  GRASP",
        "END.",
    ]
    after = layout(text)
    numbered = layout(text, numbers=50).splitlines()

    assert [line.strip() for line in after.splitlines()] == [line.strip() for line in plain_lines]
    assert [line[:5].strip() for line in numbered] == [str(50 * number) for number in range(1, 9)]
    assert [line[5:] for line in numbered] == after.splitlines()
    assert layout("\n".join(numbered)) == after


def test_numbers_and_comments() -> None:
    """A line of a comment whose start would make its number part of the comment gets none."""
    after = check_kept("BEGIN { a\n ) b\n 12 c }\nEND.", numbers=10)

    assert after.splitlines()[1].strip() == ") b"


def test_wrong_programs() -> None:
    """A program with a slip of syntax is not laid out; the message tells the first slip and its place."""
    with pytest.raises(UnformattableError, match=r"t\.rlo:2:1: cannot be formatted: unknown statement `MVOE` \(E105\)"):
        layout("BEGIN\nMVOE ARM_1 TO f ; GRASP GRASP\nEND")
    with pytest.raises(UnformattableError, match="E214"):
        layout("BEGIN FOR i = 1 TO 2 DO HALT END.", Standard.RLO_83)


def test_programs_with_other_errors() -> None:
    """What is wrong with names and types does not keep a program from being laid out: every word stays."""
    long = "a" * 40
    types = "VAR f:thing;g:FRMAE;BEGIN END."
    assert check_kept(types) == "VAR f : thing ;\n    g : FRMAE ;\nBEGIN\nEND.\n"
    assert layout(types, Standard.RLO_83) == layout(types)
    assert layout(f"VAR {long}:SCALAR;BEGIN {long}=1 END.") == (f"VAR {long} : SCALAR ;\nBEGIN\n  {long} = 1\nEND.\n")
    assert layout("VAR n:SCALAR;module m;BEGIN n=1 END.") == ("VAR n : SCALAR ;\nMODULE m ;\nBEGIN\n  n = 1\nEND.\n")


@pytest.mark.parametrize("option", ["numbers", "width"])
def test_senseless_options(option: str) -> None:
    """Numbers and widths count from 1."""
    with pytest.raises(InvalidValueError, match=f"{option}: expected 1 or more, got 0"):
        layout("BEGIN END.", **{option: 0})


@given(st.text(max_size=60), st.sampled_from(Standard))
def test_any_text(text: str, std: Standard) -> None:
    """Any text is laid out or refused; within a comment anything may stand."""
    with suppress(UnformattableError):
        layout(text, std)
    inside = text.replace("}", "").replace("\r", "")
    check_kept(f"{{{inside}}} BEGIN {{{inside}}} END. {{{inside}}}", std)
