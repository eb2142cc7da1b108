"""``armwright kernel``: the compiled form of an equation for an arm."""

from typing import Annotated

from typer import Argument, Option

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json
from armwright.cli.shell_completion import listed_in


def kernel(
    arm: ArmName,
    quantity: Annotated[
        str,
        Argument(
            help="Quantity: forward, jacobian, inverse_branches, inverse_dynamics, forward_dynamics ...",
            autocompletion=listed_in("armwright.compiled.quantities", "quantity_names"),
        ),
    ],
    count: Annotated[bool, Option("--count", help="Print the operation count only.")] = False,
    single: Annotated[
        bool,
        Option("--single", help="Print the function for a single configuration instead of an array of them."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Print the compiled kernel of a quantity for an arm, and its operation count.

    **Example:** `armwright kernel stanford-jpl inverse_dynamics --count`
    """
    from armwright.arm.load import load_arm
    from armwright.compiled.quantities import emit_quantity
    from armwright.tracing.native import processor

    emitted = emit_quantity(load_arm(arm), quantity)
    total = sum(emitted.operations.values())
    target = processor().target
    source = emitted.single_ir(target) if single else emitted.rows_ir(target)
    if as_json:
        counts = {"operations": emitted.operations, "total": total, "joined": emitted.joined}
        print_json({**counts, "source": source})
        return
    if not count:
        print(source)
    print(f"{emitted.title}: {total} operations per configuration; {emitted.joined} additions are fused with a product")
    for name, number in emitted.operations.items():
        print(f"  {name:<12}{number:>5}")
