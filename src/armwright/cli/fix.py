"""``armwright fix``: slips that have one certain cure, cured in place."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.failures import failure_data
from armwright.cli.output import print_json
from armwright.cli.programs import Std
from armwright.errors import ArmwrightError, ExitStatus, counted
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.cell.model import Cell
    from armwright.program import Compilation, Source
    from armwright.program.diagnostics.fixes import Fixed, Translate


def fix(
    programs: Annotated[
        list[Path], typer.Argument(metavar="PROGRAM", help="Programs in RLO; `-` reads from the standard input.")
    ],
    cell: Annotated[
        Path | None, typer.Option("--cell", help="The cell they will run in; what is left is then checked against it.")
    ] = None,
    diff: Annotated[
        bool, typer.Option("--diff", "--dry-run", help="Write nothing; show what would change and what would be left.")
    ] = False,
    std: Std = Standard.RLO_2,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was done and what is left as JSON.")] = False,
) -> None:
    """Cure what is certain in RLO programs: a missing `;` or `=`, a matrix row by row, look-alike characters.

    A program from the standard input or a pipe is printed as it becomes; what was done is told on the error output.

    Exit status 0: no program has errors any more; 1: something is left to do by hand.

    **Example:** `armwright fix examples/bench.rlo --diff`
    """
    from armwright.cli.programs import given_cell
    from armwright.cli.source_files import is_stream, print_difference, read_source, write_back
    from armwright.cli.terminal import print_verbatim
    from armwright.program.diagnostics.fixes import fixed

    acted_on = given_cell(cell)
    rows: list[dict[str, Any]] = []
    for path in programs:
        printed = is_stream(path)
        try:
            source = read_source(path)
            result = fixed(source, _translator(path.parent, acted_on, std))
            if result.cures and not (diff or printed):
                write_back(source, path, result.text)
        except ArmwrightError as error:
            rows.append({"program": str(path), "errors": 1, **failure_data(error.exit_status, error, str(error))})
            if not as_json:
                print(f"armwright: {error}", file=sys.stderr)
            continue
        rows.append(_as_data(result) | ({"text": result.text} if printed else {}))
        if as_json:
            continue
        if diff and result.cures:
            print_difference(source, result.text)
        elif printed and not diff:
            print_verbatim(result.text)
        _print(result, done="could be cured" if diff else "cured", to_errors=printed and not diff)
    if as_json:
        print_json(rows)
    if any(row["exit_status"] for row in rows):
        raise typer.Exit(max(row["exit_status"] for row in rows))


def _translator(folder: Path, cell: "Cell | None", std: Standard) -> "Translate":
    """Return what finds out what is wrong with a program: in a cell, or in the one it IMPORTs."""
    from armwright.program import compile as translate, known_cell
    from armwright.program.api import import_reader

    def find(source: "Source") -> "Compilation":
        read = import_reader(folder)
        known = known_cell(cell) if cell else None
        found = translate(source, known, std=std, read_import=read)
        own = next((one.cell for one in found.imports if one.cell and one.cell.arms), None)
        if known is None and own is not None:
            found = translate(source, known_cell(own), std=std, read_import=read)
        return found

    return find


def _print(result: "Fixed", *, done: str, to_errors: bool) -> None:
    from armwright.cli.programs import print_diagnostics

    out = sys.stderr if to_errors else sys.stdout
    for cure in result.cures:
        source, start = cure.source, cure.diagnostic.span.start
        place = f"{source.name}:{source.line(start)}:{source.column(start)}"
        print(f"{place}: {cure.diagnostic.message} ({cure.diagnostic.code}): {cure.what}", file=out)
    count = len(result.cures)
    slips = f"{counted(count, 'slip')} {done}" if count else "nothing to cure"
    print(f"{result.compilation.source.name}: {slips}", file=out)
    if result.compilation.diagnostics:
        print_diagnostics(result.compilation.diagnostics, result.compilation.source, to_errors=to_errors)


def _as_data(result: "Fixed") -> dict[str, Any]:
    from armwright.cli.programs import diagnostics_data
    from armwright.program.language.diagnostic import to_json

    cures = [{**to_json(cure.diagnostic, cure.source), "done": cure.what} for cure in result.cures]
    found = diagnostics_data(result.compilation)
    status = ExitStatus.PROGRAM_ERRORS if found["errors"] else ExitStatus.DONE
    return {**found, "exit_status": status, "cures": cures}
