"""``armwright fmt``: format programs in place."""

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.failures import failure_data
from armwright.cli.options import Json
from armwright.cli.output import print_json
from armwright.cli.programs import ProgramFiles, Std
from armwright.errors import ArmwrightError, ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.language.source import Source


def fmt(  # noqa: C901, PLR0917 - Typer reads one parameter per option
    programs: ProgramFiles,
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; end with exit status 5 if a program would change.")
    ] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Write nothing; print the changes.")] = False,
    stdout: Annotated[
        bool, typer.Option("--stdout", help="Print the formatted programs and leave their files unchanged.")
    ] = False,
    numbers: Annotated[
        int | None, typer.Option(min=1, help="Step of the line numbers; without it lines are not numbered.")
    ] = None,
    std: Std = Standard.RLO_2,
    as_json: Json = False,
) -> None:
    """Format RLO programs: one statement per line, indented, keywords in upper case, comments preserved.

    A program with syntax errors is reported and not changed, as the ends of its blocks are not known; the other
    programs are written. In an editor the language server formats the statements around the errors.

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
            print(_outcome(source, changed=row["changed"], check=check))
    if as_json:
        print_json(rows)
    if any(row["exit_status"] for row in rows):
        raise typer.Exit(max(row["exit_status"] for row in rows))


def _outcome(source: "Source", *, changed: bool, check: bool) -> str:
    if not changed:
        return f"unchanged: {source.name}"
    return f"would change: {source.name}" if check else f"formatted: {source.name}"
