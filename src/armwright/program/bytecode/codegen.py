"""Code generation: from a checked tree to intermediate code."""

from collections.abc import Mapping

from armwright.program.bytecode import control_flow, devices, frames, move, output, queues
from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.emitter import Emitter
from armwright.program.bytecode.instructions import Code, Op, ProcedureCode
from armwright.program.flow_analysis.analysis import Flow
from armwright.program.language.kinds import VariableType
from armwright.program.language.source import Source
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree

_FAMILIES = (frames, devices, move, queues, control_flow, output)
GENERATORS: Generators = {node: generate for family in _FAMILIES for node, generate in family.GENERATORS.items()}


def generate(source: Source, program: tree.Program, symbols: Symbols, flow: Flow, spelling: Mapping[str, str]) -> Code:
    """Return the code of a program.

    Args:
        source: its text.
        program: without errors.
        symbols: its names.
        flow: the arms of its statements.
        spelling: how it writes its names.
    """
    out = Emitter(source, symbols.scope(None))
    context = Context(GENERATORS, out, flow, spelling)
    context.generate(*symbols.constant_assignments(program))
    context.generate_list(*program.statements)
    out.begin()
    out.emit(Op.STOP, span=program.end)
    procedures = {}
    for procedure in program.procedures:
        own = symbols.procedures[procedure.name.key]
        start, out.scope = out.here.index, symbols.scope(procedure.name.key)
        context.generate_list(*procedure.body.statements)
        out.begin()
        out.emit(Op.RET if own.result is None else Op.NORET, span=procedure.body.end)
        procedures[procedure.name.key] = ProcedureCode(
            start=start, parameters=own.parameters, types=_known(own.types), inout=own.inout, result=own.result
        )
    return Code(
        instructions=tuple(out.instructions),
        constants=tuple(out.constants),
        types=_known(symbols.types),
        procedures=procedures,
        units=symbols.units,
        spelling={key: text for key, text in spelling.items() if text != key},
        source=source,
    )


def _known(types: Mapping[str, VariableType | None]) -> dict[str, VariableType]:
    return {key: kind for key, kind in types.items() if kind is not None}
