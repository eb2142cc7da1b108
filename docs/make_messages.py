"""The page of all messages, made from what `armwright explain` knows; `make messages` runs this."""

from collections.abc import Iterator
from pathlib import Path

from armwright.program.diagnostics.index import explanation, ranges

PAGE = Path(__file__).parent / "messages.md"
HEAD = """\
# Messages

What `armwright check`, `armwright run` and the editors say of a program has a code, which stays the same whatever \
the words. `armwright explain E206` prints what stands here, with the message that the wrong program gets; `armwright \
explain` lists all codes. What the language is stands in [language.md](language.md).

| Codes | About | Said |
|---|---|---|
| E1.. | syntax: words and signs | by the translator |
| E2.. | names, types, values and clauses | by the translator; of values that are worked out, while the program runs |
| E3.. | frames: where they are and what they hang on | by the translator; while the program runs where it could not \
tell before |
| E4.. | motion: what an arm cannot do | while the program runs, before the MOVE begins |
| E5.. | processes that cannot go on, programs without end | by the translator where it can see it, else while the \
program runs |
| R6.. | devices and cameras | by the translator if the cell is known, else while the program runs |
| W... | what is allowed, and most likely not meant | both; a warning keeps no program from running |
| L3.. | the style of working: a closed hand, a name without use | by the translator; a warning too |

With an error of syntax the statements are read, and names and types checked, but not followed: what stands where, \
what hangs on what and who waits for whom is judged once the syntax is right. One mistake is told once; what follows \
from it is not told again.

Comments at the beginning of a program below say how it is looked at: `// std=83` and `// strict` are options of \
`armwright check`; `// cell: arms ARM_1` tells what is in the cell it is checked against, and `// import:` what is in \
the file that it imports. `// run in one_arm` means that the message comes while it runs, in one of four small cells: \
a Stanford arm (`one_arm`), the same above a plane of contact (`plane`), a PUMA 560 (`puma`) and a UR5 (`ur5`), with \
`// limits:`, `// around:` and `// effort:` for the options and limits that matter.
"""


def lines() -> Iterator[str]:
    """Give the lines of the page."""
    yield HEAD
    for name, codes in ranges().items():
        yield f"**{name}**\n"
        yield "| Code | Says |\n|---|---|"
        for code in codes:
            yield f"| [{code}](#{code.lower()}) | {explanation(code).title} |"
        yield ""
    for name, codes in ranges().items():
        yield f"## {name}\n"
        for page in map(explanation, codes):
            title = page.title[0].upper() + page.title[1:]
            yield f"### {page.code}\n\n**{title}.** {page.text}\n"
            yield f"Wrong:\n\n```\n{page.wrong}```\n\nRight:\n\n```\n{page.right}```\n"


def text() -> str:
    """Return the page."""
    return "\n".join(lines()).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
