"""Diagnostics on the page: marks under the right characters, whatever stands before them."""

import json
import time

import pytest

from armwright.program import Source, compile as translate
from armwright.program.diagnostics.render import MAX_SHOWN, render, render_rich
from armwright.program.language.diagnostic import Diagnostic, Fix, Label, Severity, to_json
from armwright.program.language.source import Span

# Two thousand messages take a quarter of a second [s]; looking at the whole line for each takes minutes.
GENEROUS = 5.0


def one(text: str, marked: str, *, secondary: tuple[Label, ...] = ()) -> list[str]:
    """Return the rows that show ``marked`` in ``text``."""
    start = text.index(marked)
    diagnostic = Diagnostic(
        code="E105", message="what", span=Span(start, start + len(marked)), label="here", secondary=secondary
    )
    return render([diagnostic], Source("t.rlo", text)).splitlines()


def test_tabs() -> None:
    """Tabs are shown as blanks up to the next stop, and the marks follow; the column counts characters."""
    rows = one("a\tb\t\tbad ;", "bad")

    assert rows[1] == "  --> t.rlo:1:6"
    assert rows[3] == " 1 | a   b       bad ;"
    assert rows[4] == "   |             ^^^ here"


def test_wide_characters() -> None:
    """A character that takes two columns of a terminal moves and lengthens the marks by two."""
    rows = one("{架子} 架 ;", "架 ;"[0:1] + " ;")

    assert rows[3] == " 1 | {架子} 架 ;"
    assert rows[4] == "   | " + " " * 7 + "^^^^ here"


def test_control_characters() -> None:
    """A character that would disturb the terminal is shown by a stand-in."""
    rows = one("a\x1b[31m bad", "bad")

    assert "\x1b" not in rows[3]
    assert rows[3].index("bad") == rows[4].index("^")


def test_behind_the_end_of_a_line() -> None:
    """Something missing at the end of a line is marked behind its last character."""
    text = "OPEN ARM_1\nGRASP"
    diagnostic = Diagnostic(code="E104", message="what", span=Span(10, 10), label="here")

    assert render([diagnostic], Source("t.rlo", text)).splitlines()[4] == "   |           ^ here"


def test_stretch_of_several_lines() -> None:
    """A stretch that goes on in the next line is marked to the end of its first."""
    rows = one("f = (1,0,\n 0) ;", "(1,0,\n 0)")

    assert rows[4] == "   |     ^^^^^ here"
    assert len(rows) == 7


def test_distant_lines() -> None:
    """Lines in between are left out, the gutter is as wide as the largest number."""
    text = "\n".join(f"line{number}" for number in range(1, 121))
    rows = one(
        text,
        "line120",
        secondary=(Label(Span(0, 5), "there"), Label(Span(text.index("line119"), text.index("line119") + 7), "near")),
    )

    assert rows[1:11] == [
        "   --> t.rlo:120:1",
        "    |",
        "  1 | line1",
        "    | ----- there",
        "...",
        "119 | line119",
        "    | ------- near",
        "120 | line120",
        "    | ^^^^^^^ here",
        "",
    ]


@pytest.mark.parametrize(
    ("severities", "line"),
    [
        ([], "t.rlo: no errors"),
        (["error"], "t.rlo: 1 error"),
        (["error", "error", "warning"], "t.rlo: 2 errors, 1 warning"),
        (["warning", "warning"], "t.rlo: 2 warnings"),
    ],
)
def test_count_line(severities: list[str], line: str) -> None:
    """The last line counts errors and warnings."""
    diagnostics = [
        Diagnostic(code="E101", severity=Severity(severity), message="what", span=Span(0, 1)) for severity in severities
    ]

    assert render(diagnostics, Source("t.rlo", "x")).splitlines()[-1] == line


def test_colour_changes_no_character() -> None:
    """With colour the same characters are shown."""
    compilation = translate(Source("t.rlo", "BEGIN\n\tOPNE ARM - 1\nEND"))
    plain = render(compilation.diagnostics, compilation.source)
    rich = render_rich(compilation.diagnostics, compilation.source)

    assert rich.plain == plain
    assert any("red" in str(span.style) for span in rich.spans)


def test_order() -> None:
    """Diagnostics come in the order of the text."""
    compilation = translate(Source("t.rlo", "BEGIN\nMOVE ARM_1 TO b ;\nOPEN ARM 1 ;\nEND"))

    starts = [diagnostic.span.start for diagnostic in compilation.diagnostics]
    assert starts == sorted(starts)
    assert [diagnostic.code for diagnostic in compilation.diagnostics] == ["E202", "E106", "E110"]


def test_json() -> None:
    """As data a diagnostic has its lines and columns, and the change that cures it."""
    source = Source("t.rlo", "BEGIN\n  OPEN ARM - 1 ;\nEND.")
    data = json.loads(json.dumps(to_json(translate(source).diagnostics[0], source)))

    assert (data["code"], data["severity"], data["line"], data["column"]) == ("E106", "error", 2, 8)
    assert data["fixes"] == [{"line": 2, "column": 8, "start": 13, "end": 20, "replacement": "ARM_1"}]


def test_json_of_labels() -> None:
    """Labels on other places come with their places."""
    source = Source("t.rlo", "ab\ncd")
    label = Label(Span(3, 5), "there")
    fix = Fix(Span(0, 1), "x")
    data = to_json(Diagnostic(code="E101", message="m", span=Span(0, 2), secondary=(label,), fixes=(fix,)), source)

    assert data["secondary"] == [{"line": 2, "column": 1, "start": 3, "end": 5, "label": "there"}]


def test_very_long_lines() -> None:
    """Of a line of thousands of characters the part around the place is shown, and the marks stand under it."""
    text = "VAR n : SCALAR ; BEGIN n = " + "1 + " * 2000 + "m" + " + 1" * 2000 + " END."
    source = Source("long.rlo", text)
    label = Diagnostic(code="E202", message="`m`", span=Span(text.index("m"), text.index("m") + 1), label="here")
    rows = render([label], source).splitlines()
    line, marks = rows[3], rows[4]

    assert len(line) < 260
    assert line.startswith(" 1 | ...")
    assert line.endswith("...")
    assert line[marks.index("^")] == "m"


def test_places_outside_the_part_that_is_shown() -> None:
    """A second place far off in the same line is marked at the edge of the part that is shown."""
    text = "ab" * 2000
    label = Diagnostic(
        code="E202", message="far", span=Span(2000, 2002), label="here", secondary=(Label(Span(4, 6), "there"),)
    )
    rows = render([label], Source("long.rlo", text)).splitlines()

    assert rows[4].endswith("-- there") or rows[4].endswith("- there")
    assert rows[3][rows[5].index("^^") :][:2] == "ab"


def test_thousands_in_one_line() -> None:
    """A program may be one line: thousands of messages about it take no longer than about as many lines."""
    text = "x ;" * 20_000
    diagnostics = [
        Diagnostic(code="E105", message="what", span=Span(at, at + 1), label="here")
        for at in range(0, len(text), len(text) // 2000)
    ]
    started = time.process_time()
    several = [diagnostics[at : at + MAX_SHOWN] for at in range(0, len(diagnostics), MAX_SHOWN)]
    rows = [row for some in several for row in render(some, Source("t.rlo", text)).splitlines()]

    assert len(rows) > 10_000
    assert time.process_time() - started < GENEROUS


def test_more_messages_than_one_reads() -> None:
    """Of thousands of messages the first hundred are shown, errors before warnings, and the others are counted."""
    text = "VAR f : FRAME ;\nBEGIN\n" + "".join(f"  f{number} = 1 ;\n" for number in range(3000)) + "END.\n"
    compiled = translate(Source("t.rlo", text))
    shown = render(compiled.diagnostics, compiled.source)

    assert len(compiled.diagnostics) == 3001
    assert shown.count("error[E202]") == 100
    assert "L304" not in shown
    assert (
        "note: 2901 more are not shown; one mistake may have caused many. `armwright check --format json` prints all"
        in shown.splitlines()
    )
    assert shown.endswith("t.rlo: 3000 errors, 1 warning\n")
