"""``armwright show``: the tables of an arm."""

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json

# Width at which tables are measured [characters]; none is wider.
_WIDEST = 200


def show(arm: ArmName, as_json: Json = False) -> None:
    """Print the Denavit-Hartenberg, limit, inertia and drive tables of an arm.

    The tables are in degrees and millimetres; --json prints SI units and radians.

    **Example:** `armwright show puma560`
    """
    from rich import box
    from rich.table import Table

    from armwright.arm.description import as_data, facts, tables
    from armwright.arm.load import load_arm
    from armwright.cli.terminal import console as clean_console

    model = load_arm(arm)
    if as_json:
        print_json(as_data(model))
        return
    console = clean_console(emoji=False)
    console.print(f"{model.name}: {model.title}" if model.title else model.name, style="bold")
    if model.source:
        console.print(model.source, style="dim")
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
