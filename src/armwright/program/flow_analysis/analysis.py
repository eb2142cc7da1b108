"""Data-flow analysis along all paths through a program: values, affixments, arms.

An error is reported only where every run that reaches the statement fails. Where paths merge, the facts on which they
agree are kept; a loop is analysed twice: its first pass, and any pass, with what it changes invalidated.
"""

from collections.abc import Mapping

import attrs

from armwright.program.flow_analysis import (
    calls,
    concurrency,
    control_flow,
    data_races,
    devices,
    frames,
    move,
    output,
    queues,
)
from armwright.program.flow_analysis.context import Context, Steps
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source
from armwright.program.semantics.cell_symbols import KnownCell
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax import tree

STEPS: Steps = {**frames.STEPS, **devices.STEPS, **move.STEPS, **queues.STEPS, **control_flow.STEPS, **output.STEPS}


@attrs.frozen(kw_only=True)
class Flow:
    """Results of the analysis for code generation, by where statements start.

    Attributes:
        arms: the arm that a MOVE moves or a GRASP closes, where it is the same on every path there.
        implied: MOVEs that always affix the grasped frame to its arm first.
    """

    arms: Mapping[int, str]
    implied: frozenset[int]


def check(
    program: tree.Program,
    symbols: Symbols,
    spelling: Mapping[str, str],
    cell: KnownCell | None = None,
    *,
    source: Source,
    strict: bool = False,
) -> tuple[Flow, list[Diagnostic]]:
    """Analyse a program.

    Args:
        program: without errors of syntax.
        symbols: its names.
        spelling: how it writes them.
        cell: what it will act on; without one, frames may get their values later.
        source: its text.
        strict: whether an AFFIX that is only implied is an error.

    Returns:
        The results for code generation, and the diagnostics.
    """
    state = FlowState(program, symbols, spelling, cell, source=source, strict=strict)
    context = Context(STEPS, state)
    for constant in symbols.constant_assignments(program):
        frames.assign(state, constant)
    context.follow(*program.statements)
    state.ended = False
    calls.follow_uncalled(context)
    findings = [*state.diagnostics, *concurrency.check(program, symbols, source), *data_races.check(program, symbols)]
    arms = {start: arm for start, arm in state.arms.items() if arm is not None}
    return Flow(arms=arms, implied=frozenset(start for start, always in state.implied.items() if always)), findings
