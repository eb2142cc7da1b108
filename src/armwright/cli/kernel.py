"""``armwright kernel``: what an equation becomes for one arm."""

from typing import Annotated

import typer


def kernel(
    arm: Annotated[str, typer.Argument(help="Name in the catalogue, or path of an arm file.", show_default=False)],
    quantity: Annotated[str, typer.Argument(help="forward, jacobian or inverse_dynamics.", show_default=False)],
    count: Annotated[bool, typer.Option("--count", help="Print the operation count only.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print source and operation count as JSON.")] = False,
) -> None:
    """Print the kernel that a quantity is compiled to for an arm, and its operation count.

    **Example:** `armwright kernel stanford-jpl inverse_dynamics --count`
    """
    import json

    from armwright.arm.load import load_arm
    from armwright.dynamics.quantities import emit_quantity

    emitted = emit_quantity(load_arm(arm), quantity)
    total = sum(emitted.operations.values())
    if as_json:
        print(json.dumps({"operations": emitted.operations, "total": total, "source": emitted.source}, indent=2))
        return
    if not count:
        print(emitted.source)
    print(f"{emitted.title}: {total} operations per configuration")
    for name, number in emitted.operations.items():
        print(f"  {name:<12}{number:>5}")
