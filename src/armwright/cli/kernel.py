"""``armwright kernel``: the compiled form of an equation for an arm."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from typer import Argument, Option

from armwright.cli.options import ArmName, Json, usage_error
from armwright.cli.output import print_json
from armwright.cli.shell_completion import listed_in

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.tracing.emit import Emitted

Language: TypeAlias = Literal["llvm", "c", "cpp", "cuda"]
Real: TypeAlias = Literal["double", "float"]


def kernel(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    quantity: Annotated[
        str,
        Argument(
            help="Quantity: forward, jacobian, inverse_branches, inverse_dynamics, forward_dynamics ...; in C, C++ and "
            "CUDA several, as in inverse_dynamics,jacobian.",
            autocompletion=listed_in("armwright.compiled.quantities", "quantity_names"),
        ),
    ],
    count: Annotated[bool, Option("--count", help="Print the operation count only.")] = False,
    single: Annotated[
        bool,
        Option("--single", help="Print the function for a single configuration instead of an array of them."),
    ] = False,
    language: Annotated[
        Language,
        Option(help="The LLVM IR of this processor, a header of C99, a header of C++ templates, or kernels of CUDA."),
    ] = "llvm",
    real: Annotated[Real, Option(help="Type of the numbers in C, and in the test of the C++ templates.")] = "double",
    test: Annotated[
        bool,
        Option("--test", help="Add a main, in C or C++, that compares 20 configurations with the plain functions."),
    ] = False,
    output: Annotated[
        Path | None, Option("-o", "--output", help="File for the source; without it, it is printed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the compiled kernel of a quantity for an arm, as LLVM IR, C, C++ or CUDA, and its operation count.

    **Example:** `armwright kernel ur5 inverse_dynamics,jacobian --language c -o ur5.h`
    """
    from armwright.arm.load import load_arm
    from armwright.compiled.quantities import emit_quantity
    from armwright.files.output import write_file

    _check_options(language, real, single=single, test=test)
    if language == "llvm" and "," in quantity:
        raise usage_error("QUANTITY", "expected one with --language llvm; c, cpp and cuda have several in one text")
    names = [quantity] if language == "llvm" else quantity.split(",")
    model = load_arm(arm)
    emitted = [emit_quantity(model, name) for name in names]
    source = _llvm(emitted[0], single=single) if language == "llvm" else _text(model, names, language, real, test=test)
    if output is not None:
        write_file(output, source)
    if as_json:
        written = {} if output is None else {"written": str(output)}
        print_json({**_counts(emitted), "language": language, **written, "source": source})
        return
    if output is not None:
        print(f"{', '.join(names)} of {model.name} written to {output}")
    elif not count:
        # Text for a compiler is printed alone, so that it can be sent on.
        print(source, end="" if language != "llvm" else "\n")
    if count or (language == "llvm" and output is None):
        for each in emitted:
            _print_count(each)


def _check_options(language: Language, real: Real, *, single: bool, test: bool) -> None:
    """Refuse options that the language does not have."""
    if real == "float" and language not in {"c", "cpp"}:
        raise usage_error("--real", f"expected double for {language}, got float; --language c and cpp have float")
    if test and language not in {"c", "cpp"}:
        raise usage_error("--test", f"expected --language c or cpp, got {language}")
    if real == "float" and language == "cpp" and not test:
        raise usage_error("--real", "expected --test with float: the C++ templates are for any type of numbers")
    if single and language != "llvm":
        raise usage_error("--single", f"expected --language llvm, got {language}")


def _llvm(emitted: "Emitted", *, single: bool) -> str:
    from armwright.tracing.native import processor

    target = processor().target
    return emitted.single_ir(target) if single else emitted.rows_ir(target)


def _text(arm: "Arm", names: list[str], language: Literal["c", "cpp", "cuda"], real: Real, *, test: bool) -> str:
    from armwright.compiled.source_check import check_text
    from armwright.compiled.source_text import source_text

    return (check_text if test else source_text)(arm, names, language, real)


def _counts(emitted: "list[Emitted]") -> dict[str, object]:
    operations = {op for each in emitted for op in each.operations}
    counts = {op: sum(each.operations.get(op, 0) for each in emitted) for op in sorted(operations)}
    return {"operations": counts, "total": sum(counts.values()), "joined": sum(each.joined for each in emitted)}


def _print_count(emitted: "Emitted") -> None:
    total = sum(emitted.operations.values())
    print(f"{emitted.title}: {total} operations per configuration; {emitted.joined} additions are fused with a product")
    for name, number in emitted.operations.items():
        print(f"  {name:<12}{number:>5}")
