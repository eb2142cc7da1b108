"""``armwright fmt``: format programs in place."""

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from armwright.cli.options import Json
from armwright.cli.programs import ProgramFiles, Std
from armwright.errors import ExitStatus
from armwright.program.language.words import Standard


def fmt(  # noqa: PLR0917 - Typer reads one parameter per option
    programs: ProgramFiles,
    check: Annotated[
        bool, Option("--check", help="Write nothing; end with exit status 5 if a program would change.")
    ] = False,
    diff: Annotated[bool, Option("--diff", help="Write nothing; print the changes.")] = False,
    stdout: Annotated[
        bool, Option("--stdout", help="Print the formatted programs and leave their files unchanged.")
    ] = False,
    numbers: Annotated[
        int | None, Option(min=1, help="Step of the line numbers; without it lines are not numbered.")
    ] = None,
    std: Std = Standard.RLO_2,
    as_json: Json = False,
) -> None:
    """Format RLO programs: one statement per line, indented, keywords in upper case, comments preserved.

    A program with syntax errors is reported and not changed, as the ends of its blocks are not known; the other
    programs are written. In an editor the language server formats the statements around the errors.

    **Example:** `armwright fmt examples/peg.rlo --diff`
    """
    from armwright.cli.source_files import is_stream, print_difference, read_source, rewrite_all
    from armwright.cli.terminal import print_verbatim
    from armwright.files.output import write_back
    from armwright.program.formatter.format import formatted

    def rewrite(path: Path, row: dict[str, Any]) -> None:
        source, streamed = read_source(path), is_stream(path)
        after = formatted(source, std=std, numbers=numbers)
        changed = row["changed"] = after != source.text
        if changed and not (check or diff or stdout or streamed):
            write_back(path, source.text, after, "program_mb")
        if check and changed:
            row["exit_status"] = ExitStatus.CHECK_FAILED
        if as_json:
            row |= {"text": after} if stdout or streamed else {}
        elif diff:
            print_difference(source, after)
        elif stdout or (streamed and not check):
            print_verbatim(after)
        else:
            outcome = "unchanged" if not changed else "would change" if check else "formatted"
            print(f"{outcome}: {source.name}")

    rewrite_all(programs, rewrite, as_json=as_json)
