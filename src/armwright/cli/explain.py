"""``armwright explain``: what the code of a message means, with a wrong program and a right one."""

import re
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.output import print_json
from armwright.cli.shell_completion import codes

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from armwright.program.diagnostics.index import Page
    from armwright.program.language.diagnostic import Diagnostic
    from armwright.program.language.source import Source

_WIDTH = 80
_INDENT = "    "
# Does not end a line.
_BLANK = "\N{NO-BREAK SPACE}"


def explain(
    code: Annotated[
        str | None,
        typer.Argument(help="Of a message, such as E206; without one all codes are listed.", autocompletion=codes),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Explain the code of a message: what it means, what to do, a wrong program and a right one.

    **Example:** `armwright explain E206`
    """
    if code is None:
        _list(as_json=as_json)
        return
    from armwright.cli.terminal import console as clean_console
    from armwright.program.diagnostics.examples import answer
    from armwright.program.diagnostics.index import explanation
    from armwright.program.language.source import Source

    page = explanation(code)
    source = Source("wrong.rlo", page.wrong)
    said = answer(source)
    if as_json:
        _print_json(page, said, source)
        return
    console = clean_console()
    if console.is_terminal:
        _show(console, page, said, source)
    else:
        print("\n".join(_plain(page, said, source)))


def _list(*, as_json: bool) -> None:
    """Print all codes with their titles."""
    from armwright.program.diagnostics.index import explanation, ranges

    if as_json:
        rows = [
            {"code": code, "title": explanation(code).title, "range": name}
            for name, codes in ranges().items()
            for code in codes
        ]
        print_json(rows)
        return
    for number, (name, about) in enumerate(ranges().items()):
        print(f"{chr(10) if number else ''}{name}")
        for code in about:
            print(f"  {code}  {explanation(code).title}")


def _print_json(page: "Page", said: "Sequence[Diagnostic]", source: "Source") -> None:
    import attrs

    from armwright.program.language.diagnostic import to_json

    data: dict[str, Any] = {**attrs.asdict(page), "diagnostics": [to_json(one, source) for one in said]}
    print_json(data)


def _plain(page: "Page", said: "Sequence[Diagnostic]", source: "Source") -> Iterator[str]:
    """Return a page as lines of plain text."""
    from armwright.program.diagnostics.render import render

    yield f"{page.code}: {page.title}"
    for paragraph in page.text.split("\n\n"):
        yield ""
        # What stands in backquotes stays on one line.
        whole = re.sub(r"`[^`]+`", lambda quoted: quoted[0].replace(" ", _BLANK), paragraph)
        for line in textwrap.wrap(whole, _WIDTH, break_long_words=False, break_on_hyphens=False):
            yield line.replace(_BLANK, " ")
    yield "\nWrong:\n"
    yield textwrap.indent(page.wrong, _INDENT)
    yield render(said, source)
    yield "Right:\n"
    yield textwrap.indent(page.right, _INDENT).rstrip()


def _show(console: "Console", page: "Page", said: "Sequence[Diagnostic]", source: "Source") -> None:
    """Print a page for a person who watches."""
    from rich.markdown import Markdown
    from rich.text import Text

    from armwright.program.diagnostics.render import render_rich

    console.print(Text(f"{page.code}: {page.title}\n", "bold"))
    console.print(Markdown(page.text), width=min(console.width, _WIDTH))
    console.print(Text("\nWrong\n", "bold"))
    console.print(_coloured(page.wrong), soft_wrap=True)
    console.print(render_rich(said, source), soft_wrap=True)
    console.print(Text("Right\n", "bold"))
    console.print(_coloured(page.right), soft_wrap=True, end="")


def _coloured(program: str) -> "Text":
    """Return a program in colour, indented."""
    from rich.syntax import Syntax
    from rich.text import Text

    from armwright.program.language_server.highlight import RloLexer

    text = Syntax(program, RloLexer(), theme="ansi_dark", background_color="default").highlight(program)
    lines = text.split("\n", allow_blank=False)
    return Text("").join(Text.assemble(_INDENT, line, "\n") for line in lines)
