"""``armwright fix``: correct mistakes in programs that have a single certain correction."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from armwright.cli.options import Json
from armwright.cli.programs import CheckedCell, ProgramFiles, Std, diagnostics_data, print_diagnostics, read_cell_option
from armwright.errors import counted
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.program.diagnostics.fixes import FixResult


def fix(
    programs: ProgramFiles,
    cell: CheckedCell = None,
    diff: Annotated[
        bool, Option("--diff", "--dry-run", help="Write nothing; print the changes and the remaining errors.")
    ] = False,
    std: Std = Standard.RLO_2,
    as_json: Json = False,
) -> None:
    """Correct the mistakes in RLO programs that have a certain correction, such as a missing `;` or `=`.

    Matrices written row by row and look-alike characters are corrected too. A program from the standard input or a pipe
    is printed corrected, and the list of corrections goes to the error output.

    The exit status is 0 if no program has errors any more, and 1 if errors remain.

    **Example:** `armwright fix examples/bench.rlo --diff`
    """
    from armwright.cli.source_files import is_stream, print_difference, read_source, rewrite_all
    from armwright.cli.terminal import print_verbatim
    from armwright.files.output import write_back
    from armwright.program import compile as compile_program
    from armwright.program.api import import_reader
    from armwright.program.diagnostics.fixes import apply_fixes
    from armwright.program.language.diagnostic import to_json

    option_cell = read_cell_option(cell)

    def rewrite(path: Path, row: dict[str, Any]) -> None:
        # An unreadable file counts as one error.
        row["errors"] = 1
        source, printed = read_source(path), is_stream(path)
        read = import_reader(path.parent)
        result = apply_fixes(source, partial(compile_program, cell=option_cell, std=std, read_import=read))
        if result.applied and not (diff or printed):
            write_back(path, source.text, result.text, "program_mb")
        cures = [{**to_json(cure.diagnostic, cure.source), "done": cure.description} for cure in result.applied]
        row |= {**diagnostics_data(result.compilation), "cures": cures, **({"text": result.text} if printed else {})}
        if as_json:
            return
        if diff and result.applied:
            print_difference(source, result.text)
        elif printed and not diff:
            print_verbatim(result.text)
        _print(result, verb="could be corrected" if diff else "corrected", to_errors=printed and not diff)

    rewrite_all(programs, rewrite, as_json=as_json)


def _print(result: "FixResult", *, verb: str, to_errors: bool) -> None:
    out = sys.stderr if to_errors else sys.stdout
    for cure in result.applied:
        source, start = cure.source, cure.diagnostic.span.start
        location = f"{source.name}:{source.line(start)}:{source.column(start)}"
        print(f"{location}: {cure.diagnostic.message} ({cure.diagnostic.code}): {cure.description}", file=out)
    count = len(result.applied)
    mistakes = f"{counted(count, 'mistake')} {verb}" if count else "nothing to correct"
    print(f"{result.compilation.source.name}: {mistakes}", file=out)
    if result.compilation.diagnostics:
        print_diagnostics(result.compilation.diagnostics, result.compilation.source, to_errors=to_errors)
