"""Laying out a program in which something is wrong: what is right is laid out, and nothing changes its meaning."""

import numpy as np
import pytest

from armwright.program import Source, compile as translate
from armwright.program.formatter.format import UnformattableError, formatted
from armwright.program.formatter.partial import formatted_around
from program.shelf import ACCEPTED, CORPUS, REJECTED, compile_file
from samples import Sample

PROGRAMS = [*ACCEPTED, *REJECTED, *sorted(CORPUS.glob("*.rlo"))]


def around(text: str) -> str:
    return formatted_around(Source("t.rlo", text))


def test_statements_around_a_mistake() -> None:
    """Statements on lines of their own are laid out; those that hold a mistake or share its line stay as they are."""
    text = (
        "var f : frame ; n : scalar ;\nbegin\nn=1 ;   open arm-1 ; { a comment }\n   if n>0 then begin n=2 ;\n end ;\n"
        "  mvoe x to ;\n MOVE ARM_1 TO f with approach ; n=3 ;\nread visions(F) ; grasp ;\n   // last\n"
        '   print( "a" ,n ) ;\nend.\n'
    )

    assert around(text) == (
        "var f : frame ; n : scalar ;\nbegin\n  n = 1 ;\n  OPEN ARM_1 ;  { a comment }\n"
        "   if n>0 then begin n=2 ;\n end ;\n"
        "  mvoe x to ;\n MOVE ARM_1 TO f with approach ; n=3 ;\n  READ VISIONS (f) ;\n  GRASP ;\n  // last\n"
        '  PRINT("a", n) ;\nend.\n'
    )


def test_program_without_mistakes() -> None:
    """A program whose syntax is right is laid out as ever."""
    text = "VAR n : SCALAR ; begin n=1 ; print(n) end."

    assert around(text) == formatted(Source("t.rlo", text))


@pytest.mark.parametrize("text", ["", "BEGIN OPEN ; n = 1 ; END.", "100 BEGIN\n200 OPEN ;\n300 PAUSE  1 ;\n400 END."])
def test_nothing_to_lay_out(text: str) -> None:
    """Where no line holds right statements alone, or lines are numbered, the first mistake is told."""
    with pytest.raises(UnformattableError, match="cannot be formatted"):
        around(text)


@pytest.mark.share(0.04)
def test_damaged_programs(sample: Sample) -> None:
    """Whatever is wrong in a program, laying out the rest changes no message of it, and twice is once."""
    laid = 0
    for rng in sample.cases(600):
        path = PROGRAMS[int(rng.integers(len(PROGRAMS)))]
        compilation = compile_file(path)
        tokens = [one for one in compilation.tokens if one.end > one.start]
        text = compilation.source.text
        if not tokens:
            continue
        token = tokens[int(rng.integers(len(tokens)))]
        damage = str(rng.choice(np.array(["", " ; ", "( ", "BEGIN ", "end ", "MVOE ", " 3 "])))
        source = Source("t.rlo", text[: token.start] + damage + text[token.end :])
        try:
            after = Source("t.rlo", formatted_around(source, std=compilation.standard))
        except UnformattableError:
            continue
        laid += 1
        before, behind = (translate(one, std=compilation.standard).diagnostics for one in (source, after))
        codes = [sorted(one.code for one in several if one.code != "W101") for several in (before, behind)]
        assert codes[0] == codes[1]
        assert formatted_around(after, std=compilation.standard) == after.text
    sample.record("damaged programs laid out: the same messages, the same again", laid, 0)
