"""Names, numbers and texts of exported programs, hostile ones among them."""

import re
from typing import Any

import attrs
import pytest

from armwright.export.checkers import (
    fanuc as fanuc_checker,
    krl as krl_checker,
    rapid as rapid_checker,
    urscript as urscript_checker,
)
from armwright.export.checkers.actions import TextAction
from armwright.export.plan_mode import plan_statements
from armwright.export.statements import Say
from armwright.export.writers import fanuc, krl, rapid, urscript
from armwright.export.writers.reserved_words import FANUC, KRL, RAPID, URSCRIPT
from armwright.export.writers.text import decimal, identifier, plain_lines
from export.cases import recorded

LANGUAGES = {
    "urscript": (urscript, urscript_checker, 64, URSCRIPT),
    "krl": (krl, krl_checker, 24, KRL),
    "rapid": (rapid, rapid_checker, 32, RAPID),
    "fanuc": (fanuc, fanuc_checker, 8, FANUC),
}
HOSTILE = "\"'\\;!#&$%{}[]()\n\r\t\0\u2028\U0001f916äß\x7f\x1b END ENDPROC end def a b 0 1 _ .. /"


def hostile(rng: Any, longest: int = 200) -> str:
    """A text of characters that mean something in one language or another."""
    return "".join(HOSTILE[i] for i in rng.integers(len(HOSTILE), size=rng.integers(longest)))


@pytest.mark.share(0.01)
@pytest.mark.parametrize("target", LANGUAGES)
def test_hostile_names_and_texts(target: str, sample: Any) -> None:
    """Whatever a program is called and prints, its export is one program, with that text and nothing beside it."""
    writer, checker, limit, words = LANGUAGES[target]
    plan = plan_statements(recorded("BEGIN PAUSE 0.1 END.", target), "x")
    pause = plan.statements[0]
    count = sample.count(10_000)
    for rng in sample.cases(count):
        name, text = hostile(rng), hostile(rng)
        says = [Say(span=pause.span, text=text)]
        written = writer.write(attrs.evolve(plan, name=name, statements=(pause, *says, pause)))
        read = checker.read(written.text)

        assert re.fullmatch(rf"[A-Za-z]\w{{0,{limit - 1}}}", read.name, re.ASCII)
        assert read.name.lower() not in words
        assert written.name.rpartition(".")[0] == read.name
        shown = "".join(action.text for action in read.actions if isinstance(action, TextAction))
        assert len(shown) == len(text)
        assert all(a == b or a in "?'" for a, b in zip(shown, text, strict=True))
        assert len(read.actions) - sum(isinstance(action, TextAction) for action in read.actions) == 3
    sample.record(f"hostile names and texts in {target}", count, 0)


@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("palletise", "palletise"),
        ("2 parts", "p_2_parts"),
        ("", "p"),
        ("END", "END_2"),
        ("sin", "sin_2"),
        ("Con", "Con_2"),
        ("a-b c", "a_b_c"),
        ("ä", "p"),
        ("x" * 40, "x" * 24),
    ],
)
def test_identifiers(name: str, made: str) -> None:
    """A name keeps its letters and digits; a word of the language gets a number."""
    assert identifier(name, 24, KRL) == made


def test_clashes_are_numbered() -> None:
    """Names that become the same identifier get numbers, also where they are as long as is allowed."""
    taken: set[str] = set()
    made = []
    for name in ("a b", "a-b", "A_B", "a.b"):
        made.append(identifier(name, 5, taken))
        taken.add(made[-1].lower())

    assert made == ["a_b", "a_b_2", "A_B_3", "a_b_4"]


@pytest.mark.parametrize(("value", "text"), [(-0.0, "0.000"), (-1e-9, "0.000"), (-0.0006, "-0.001"), (12.5, "12.500")])
def test_decimals(value: float, text: str) -> None:
    """Zero has no sign."""
    assert decimal(value, 3) == text


def test_lines_of_texts() -> None:
    """A text is cut into lines that a pendant shows; an empty one is a line."""
    assert [len(line) for line in plain_lines("x" * 170)] == [80, 80, 10]
    assert plain_lines("") == [""]
    assert plain_lines('a"b\n', '"') == ["a'b?"]
