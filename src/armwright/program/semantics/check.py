"""Names and types: every name declared once and used as what it is; clauses that go together; values in range."""

from collections.abc import Collection

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.words import Standard
from armwright.program.semantics import control_flow, devices, frames, functions, headers, move, output, queues
from armwright.program.semantics.arguments import Arguments
from armwright.program.semantics.calls import CallChecker
from armwright.program.semantics.cell_symbols import ImportedFrames, KnownCell, ReadImport
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree

_FAMILIES = (frames, devices, move, queues, control_flow, output)
CHECKS: Checks = {kind: check for family in _FAMILIES for kind, check in family.CHECKS.items()}


def check(
    program: tree.Program,
    cell: KnownCell | None = None,
    *,
    std: Standard = Standard.RLO_2,
    read_import: ReadImport | None = None,
    arguments: Arguments | None = None,
    exported: Collection[str] = (),
    has_unknown_names: bool = False,
) -> tuple[Symbols, list[Diagnostic], tuple[ImportedFrames, ...]]:
    """Check names, types, clauses and values.

    Args:
        program: as the parser gave it, errors of syntax included.
        cell: what the program will act on, if that is known.
        std: the language it is written in.
        read_import: gives what the file of an IMPORT holds, and raises an ArmwrightError when it cannot be read;
            without it nothing is looked up.
        arguments: values for constants of the program, in place of their own.
        exported: names that other programs may use, of modules.
        has_unknown_names: whether any name may be that of a module that could not be read.

    Returns:
        The names of the program, what is wrong, and what was imported.

    Raises:
        UnknownNameError: an argument is for no constant of the program.
        InvalidValueError: an argument is not of the type of its constant.
    """
    names = NameResolver(cell, std)
    names.symbols.open_import = has_unknown_names
    procedures = headers.declare(names, program, read_import, arguments or {})
    calls = CallChecker(names)
    for procedure in procedures:
        with names.enter_procedure(procedure):
            Context(CHECKS, names, calls, procedure, interrupting=True).check(*procedure.node.body.statements)
            if procedure.is_function:
                functions.check_function(names, procedure)
    Context(CHECKS, names, calls).check(*program.statements)
    calls.report_fixed_arguments()
    control_flow.report_unknown_kinds(names)
    devices.report_unknown_timers(names)
    names.report_unused(exported)
    return names.symbols, names.diagnostics, tuple(names.imports)
