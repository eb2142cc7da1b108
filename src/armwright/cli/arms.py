"""``armwright arms``: the catalogue."""

from typing import Annotated

import typer

from armwright.cli.output import print_json


def arms(as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False) -> None:
    """List the arms of the catalogue.

    **Example:** `armwright arms`
    """
    from armwright.arm.load import arm_names, load_arm

    found = [load_arm(name) for name in arm_names()]
    if as_json:
        rows = [{"name": arm.name, "joints": arm.n, "title": arm.title, "source": arm.source} for arm in found]
        print_json(rows)
        return
    width = max(len(arm.name) for arm in found)
    print(f"{'name':<{width}}  joints  title")
    for arm in found:
        print(f"{arm.name:<{width}}  {arm.n:>6}  {arm.title}")
