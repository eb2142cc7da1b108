"""``armwright explain``: what the code of a diagnostic means, with a wrong program and a correct one."""

import re
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

from typer import Argument

from armwright.cli.options import Json
from armwright.cli.output import print_json
from armwright.cli.shell_completion import listed_in

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from armwright.program.diagnostics.index import Page
    from armwright.program.language.diagnostic import Diagnostic
    from armwright.program.language.source import Source

_WIDTH = 80
_INDENT = "    "
# A blank at which no line is broken.
_BLANK = "\N{NO-BREAK SPACE}"


def explain(
    code: Annotated[
        str | None,
        Argument(
            help="Code of a diagnostic, as in E206; without it all codes are listed.",
            autocompletion=listed_in("armwright.program.diagnostics.index", "codes"),
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Explain the code of a diagnostic: what it means, what to do, a wrong program and a correct one.

    **Example:** `armwright explain E206`
    """
    if code is None:
        _list(as_json=as_json)
        return
    import attrs

    from armwright.cli.terminal import console as clean_console
    from armwright.export.examples import diagnose_example
    from armwright.program.diagnostics.index import find_page
    from armwright.program.language.diagnostic import to_json
    from armwright.program.language.source import Source

    page = find_page(code)
    source = Source("wrong.rlo", page.wrong)
    diagnostics = diagnose_example(source)
    if as_json:
        print_json({**attrs.asdict(page), "diagnostics": [to_json(diagnostic, source) for diagnostic in diagnostics]})
        return
    console = clean_console()
    if console.is_terminal:
        _show(console, page, diagnostics, source)
    else:
        print("\n".join(_plain_text_lines(page, diagnostics, source)))


def _list(*, as_json: bool) -> None:
    """Print all codes with their titles."""
    from armwright.program.diagnostics.index import codes_by_range, find_page

    if as_json:
        rows = [
            {"code": code, "title": find_page(code).title, "range": name}
            for name, codes in codes_by_range().items()
            for code in codes
        ]
        print_json(rows)
        return
    for index, (name, codes_of_range) in enumerate(codes_by_range().items()):
        print(f"{chr(10) if index else ''}{name}")
        for code in codes_of_range:
            print(f"  {code}  {find_page(code).title}")


def _plain_text_lines(page: "Page", diagnostics: "Sequence[Diagnostic]", source: "Source") -> Iterator[str]:
    """Return a page as lines of plain text."""
    from armwright.program.diagnostics.render import render

    yield f"{page.code}: {page.title}"
    for paragraph in page.text.split("\n\n"):
        yield ""
        # Text in backquotes is not broken.
        unbroken = re.sub(r"`[^`]+`", lambda quoted: quoted[0].replace(" ", _BLANK), paragraph)
        for line in textwrap.wrap(unbroken, _WIDTH, break_long_words=False, break_on_hyphens=False):
            yield line.replace(_BLANK, " ")
    yield "\nWrong:\n"
    yield textwrap.indent(page.wrong, _INDENT)
    yield render(diagnostics, source)
    yield "Right:\n"
    yield textwrap.indent(page.right, _INDENT).rstrip()


def _show(console: "Console", page: "Page", diagnostics: "Sequence[Diagnostic]", source: "Source") -> None:
    """Print a page on a terminal, with styles."""
    from rich.markdown import Markdown
    from rich.text import Text

    from armwright.program.diagnostics.render import render_rich

    console.print(Text(f"{page.code}: {page.title}\n", "bold"))
    console.print(Markdown(page.text), width=min(console.width, _WIDTH))
    console.print(Text("\nWrong\n", "bold"))
    console.print(_coloured(page.wrong), soft_wrap=True)
    console.print(render_rich(diagnostics, source), soft_wrap=True)
    console.print(Text("Right\n", "bold"))
    console.print(_coloured(page.right), soft_wrap=True, end="")


def _coloured(program: str) -> "Text":
    """Return a program with its syntax highlighted, indented."""
    from rich.syntax import Syntax
    from rich.text import Text

    from armwright.program.language_server.highlight import RloLexer

    text = Syntax(program, RloLexer(), theme="ansi_dark", background_color="default").highlight(program)
    lines = text.split("\n", allow_blank=False)
    return Text("").join(Text.assemble(_INDENT, line, "\n") for line in lines)
