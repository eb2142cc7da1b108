"""The page of all messages, generated from the pages of `armwright explain`; `make messages` runs this."""

from collections.abc import Iterator
from pathlib import Path

from armwright.program.diagnostics.index import codes_by_range, find_page

PAGE = Path(__file__).parent / "messages.md"
HEAD = """\
# Messages

Every diagnostic of `armwright check`, `armwright run` and the editors has a code, which does not change when its \
text does. `armwright explain E206` prints the explanation below, and the message for the wrong program; `armwright \
explain` lists all codes. The language is described in [language.md](language.md).

| Codes | Subject | Reported by |
|---|---|---|
| E1.. | syntax: tokens and grammar | the compiler |
| E2.. | names, types, values and clauses | the compiler; for computed values, at run time |
| E3.. | frames: their poses and parents | the compiler; at run time where the compiler cannot decide |
| E4.. | motion: what an arm cannot do | at run time, before the MOVE begins |
| E5.. | deadlocks, and programs that do not end | the compiler where it can decide, otherwise at run time |
| E6.. | what cannot be exported to a controller | `armwright export` |
| R6.. | devices and cameras; mishaps in cells with physics | the compiler if the cell is known, otherwise at run time |
| W... | allowed, but probably not intended | both; a program with warnings runs |
| L3.. | style: closed grippers, unused names | the compiler; these are warnings too |

After a syntax error the remaining statements are parsed, and their names and types are checked, but the flow of the \
program is not analysed: poses, parents of frames and deadlocks are checked only when the syntax is correct. Each \
mistake is reported once; errors that follow from it are not reported.

Comments at the beginning of a program below state how it is checked: `// std=83` and `// strict` are options of \
`armwright check`; `// cell: arms ARM_1` describes the cell against which the program is checked, and `// import:` the \
contents of the imported file. `// run in one_arm` means that the message appears at run time, in one of ten small \
cells: a Stanford arm (`one_arm`), the same above a plane of contact (`plane`), above a table (`table`), above parts \
(`parts`) and above a very light one (`sheet`), a PUMA 560 (`puma`), a UR5 (`ur5`), one on springs (`springs`), a \
Stanford arm beside a belt (`belt`), and two arms with outputs and encoders (`controller`); `// export krl` \
exports the motion of the run, and `// export krl program` the program; `// physics` simulates it with \
servos, contact and grippers; `// limits:`, `// around:` and `// effort:` give the options and limits of the run.
"""


def lines() -> Iterator[str]:
    """Give the lines of the page."""
    yield HEAD
    for name, codes in codes_by_range().items():
        yield f"**{name}**\n"
        yield "| Code | Title |\n|---|---|"
        for code in codes:
            yield f"| [{code}](#{code.lower()}) | {find_page(code).title} |"
        yield ""
    for name, codes in codes_by_range().items():
        yield f"## {name}\n"
        for page in map(find_page, codes):
            title = page.title[0].upper() + page.title[1:]
            yield f"### {page.code}\n\n**{title}.** {page.text}\n"
            yield f"Wrong:\n\n```\n{page.wrong}```\n\nRight:\n\n```\n{page.right}```\n"


def text() -> str:
    """Return the page."""
    return "\n".join(lines()).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
