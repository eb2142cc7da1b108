"""``armwright fmt``: programs laid out, in place."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.failures import failure_data
from armwright.cli.output import print_json
from armwright.cli.programs import Std
from armwright.errors import ArmwrightError, ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.language.source import Source


def fmt(  # noqa: C901, PLR0917 - Typer reads one parameter per option
    programs: Annotated[
        list[Path], typer.Argument(metavar="PROGRAM", help="Programs in RLO; `-` reads from the standard input.")
    ],
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; end with exit status 5 if something would change.")
    ] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Write nothing; show what would change.")] = False,
    stdout: Annotated[bool, typer.Option("--stdout", help="Print the programs and leave their files alone.")] = False,
    numbers: Annotated[
        int | None, typer.Option(min=1, help="Number the lines in steps of this; else they get no numbers.")
    ] = None,
    std: Std = Standard.RLO_2,
    as_json: Annotated[bool, typer.Option("--json", help="Print what became of each program as JSON.")] = False,
) -> None:
    """Lay RLO programs out: one statement a line, indented, words of the language in upper case, comments kept.

    A program with a slip of syntax is left alone and told of, for behind a slip nobody knows where a block was meant to
    end; the others are written all the same. In an editor the language server lays out what stands around the slips.

    **Example:** `armwright fmt examples/peg.rlo --diff`
    """
    from armwright.cli.source_files import is_stream, print_difference, read_source, write_back
    from armwright.cli.terminal import print_verbatim
    from armwright.program.formatter.format import formatted

    rows: list[dict[str, Any]] = []
    for path in programs:
        row: dict[str, Any] = {"program": str(path), "exit_status": ExitStatus.DONE}
        rows.append(row)
        streamed = is_stream(path)
        try:
            source = read_source(path)
            after = formatted(source, std=std, numbers=numbers)
            row["changed"] = after != source.text
            if row["changed"] and not (check or diff or stdout or streamed):
                write_back(source, path, after)
        except ArmwrightError as error:
            row |= failure_data(error.exit_status, error, str(error))
            if not as_json:
                print(f"armwright: {error}", file=sys.stderr)
            continue
        if check and row["changed"]:
            row["exit_status"] = ExitStatus.CHECK_FAILED
        if as_json:
            row |= {"text": after} if stdout or streamed else {}
            continue
        if diff:
            print_difference(source, after)
        elif stdout or (streamed and not check):
            print_verbatim(after)
        else:
            print(_said(source, changed=row["changed"], check=check))
    if as_json:
        print_json(rows)
    if any(row["exit_status"] for row in rows):
        raise typer.Exit(max(row["exit_status"] for row in rows))


def _said(source: "Source", *, changed: bool, check: bool) -> str:
    if not changed:
        return f"as it should be: {source.name}"
    return f"would change: {source.name}" if check else f"laid out: {source.name}"
