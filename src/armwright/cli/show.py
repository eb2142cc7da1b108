"""``armwright show``: the tables of an arm."""

from typing import TYPE_CHECKING, Annotated

from typer import Option

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json, print_result_table

if TYPE_CHECKING:
    from armwright.arm.model import Arm

# Width at which tables are measured [characters]; none is wider.
_WIDEST = 200


def show(
    arm: ArmName,
    collisions: Annotated[
        bool, Option("--collisions", help="Print the solids of the arm and the pairs that are checked for collisions.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Print the Denavit-Hartenberg, limit, inertia and drive tables of an arm.

    The tables are in degrees and millimetres; --json prints SI units and radians. With --collisions, print instead
    the solids of its links, which pairs of them are checked for collisions, and why others are not.

    **Example:** `armwright show puma560`
    """
    from rich import box
    from rich.table import Table

    from armwright.arm.description import as_data, facts, tables
    from armwright.arm.documents import document_lines
    from armwright.arm.load import load_arm
    from armwright.cli.terminal import console as clean_console

    model = load_arm(arm)
    if collisions:
        _show_collisions(model, as_json)
        return
    if as_json:
        print_json(as_data(model))
        return
    console = clean_console(emoji=False)
    console.print(f"{model.name}: {model.title}" if model.title else model.name, style="bold")
    if model.source:
        console.print(model.source, style="dim")
    for line in document_lines(model.documents):
        console.print(line, style="dim")
    for result in tables(model):
        console.print()
        console.print(result.title, style="bold")
        if result.heads:
            table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
            for head in result.heads:
                table.add_column(head, justify="right", no_wrap=True)
            for row in result.rows:
                table.add_row(*row)
            # A narrow terminal wraps lines; it must not truncate numbers.
            width = console.measure(table, options=console.options.update(max_width=_WIDEST)).maximum
            clean_console(width=max(width, console.width)).print(table)
    console.print()
    grid = Table.grid(padding=(0, 2))
    for fact in facts(model):
        grid.add_row(*fact)
    console.print(grid)


def _show_collisions(model: "Arm", as_json: bool) -> None:
    """Print the solids of an arm, and the pairs of its bodies that are checked for collisions."""
    from armwright.cli.terminal import console
    from armwright.physics.collision_bodies import collision_bodies

    bodies = collision_bodies(model)
    if as_json:
        print_json(bodies.as_data())
        return
    terminal = console(emoji=False)
    for result in bodies.tables():
        if result.rows:
            print_result_table(terminal, result)
    for note in bodies.notes:
        terminal.print(note)
