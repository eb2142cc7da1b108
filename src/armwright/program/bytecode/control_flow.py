"""Code of control flow: choices, loops, processes, events, locks, recovery, calls."""

import attrs

from armwright.program.bytecode.context import Context, Generators, one_instruction
from armwright.program.bytecode.emitter import LATER
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree


def block(context: Context, node: tree.Block) -> None:
    """Generate the statements of a block; the fields of a record get their values in one."""
    if not node.is_assignment:
        context.generate_list(*node.statements)
        return
    context.out.begin()
    for statement in node.statements:
        context.generators[type(statement)](context, statement)


def if_(context: Context, node: tree.If) -> None:
    """Generate an IF with the ELSE IFs behind it."""
    out = context.out
    chain, otherwise = node.else_if_chain
    ends: list[int] = []
    for choice in chain:
        if choice is not node:
            out.begin()
        to_next = out.emit(Op.JZ, out.value(choice.condition), LATER, span=choice.head)
        context.generate(choice.then)
        if choice.otherwise is not None:
            ends.append(out.emit(Op.JMP, LATER, span=choice.head))
        out.patch_jump(to_next)
    if otherwise is not None:
        context.generate(otherwise)
    for end in reversed(ends):
        out.patch_jump(end)


def while_(context: Context, node: tree.While) -> None:
    """Generate a loop that is tested at its top."""
    out, top = context.out, context.out.here
    over = out.emit(Op.JZ, out.value(node.condition), LATER, span=node.head)
    context.generate(node.body)
    out.emit(Op.JMP, top, span=node.head)
    out.patch_jump(over)


def repeat(context: Context, node: tree.Repeat) -> None:
    """Generate a loop that is tested at its end."""
    out, top = context.out, context.out.here
    context.generate_list(*node.body)
    out.begin()
    out.emit(Op.JZ, out.value(node.condition), top, span=node.tail)


def for_(context: Context, node: tree.For) -> None:
    """Generate a loop that counts; its bounds may be variables that it changes, and count as they were."""
    out, head = context.out, node.head
    count = out.passing()
    bounds = [out.passing() for _ in range(3)]
    for bound, value in zip(bounds, (node.first, node.last, node.step), strict=True):
        if value is None:
            out.emit(Op.COPY, bound, 1.0, span=head)
        else:
            out.value(value, bound)
    out.emit(Op.COPY, count, 0.0, span=head)
    out.begin()
    top = out.here
    over = out.emit(Op.FOR, context.out.value(node.variable), count, *bounds, LATER, span=head)
    context.generate(node.body)
    out.emit(Op.JMP, top, span=head)
    out.patch_jump(over)


def cobegin(context: Context, node: tree.Cobegin) -> None:
    """Generate branches; HALT in one ends the program, also where the branch is part of an action."""
    out = context.out
    forks = []
    for branch in node.branches:
        priority = () if branch.priority is None else (branch.priority.value,)
        forks.append(out.emit(Op.FORK, LATER, *priority, span=branch.head))
    join = out.emit(Op.JOIN, span=node.span)
    over = out.emit(Op.JMP, LATER, span=out.instructions[join].span)
    for branch, fork in zip(node.branches, forks, strict=True):
        out.patch_jump(fork)
        context.generate_with(branch.body, in_action=False)
        out.begin()
        out.begin()
        out.emit(Op.QUIT, span=branch.body.end)
    out.patch_jump(over)


def wait(context: Context, node: tree.Wait) -> None:
    """Generate a wait for an event."""
    out, event = context.out, context.out.value(node.event)
    if node.limit is None:
        out.emit(Op.WAIT, event, span=node.span)
        return
    limit = out.value(node.limit)
    attempt = out.emit(Op.AWAIT, event, LATER, limit, span=node.head)
    over = out.emit(Op.JMP, LATER, span=node.head)
    out.patch_jump(attempt)
    _late(context, node)
    out.patch_jump(over)


def _late(context: Context, node: tree.Wait | tree.WaitUntil) -> None:
    """Generate what is done when a wait is over in vain."""
    if node.otherwise is None:
        context.out.emit(Op.LATE, span=node.head)
    else:
        context.generate(node.otherwise)


def wait_until(context: Context, node: tree.WaitUntil) -> None:
    """Generate a wait for a condition, which stands behind it, ended by RET."""
    out, limit = context.out, () if node.limit is None else (context.out.value(node.limit),)
    truth = out.passing()
    wait = out.emit(Op.UNTIL, LATER, truth, LATER, *limit, span=node.head)
    over = out.emit(Op.JMP, LATER, span=node.head)
    condition = out.here
    out.value(node.condition, truth)
    out.emit(Op.RET, span=node.head)
    late = out.here
    _late(context, node)
    out.instructions[wait] = attrs.evolve(out.instructions[wait], operands=(condition, truth, late, *limit))
    out.patch_jump(over)


def when(context: Context, node: tree.When) -> None:
    """Generate the arming of a WHEN, with condition and action behind it, each ended by RET."""
    out, truth = context.out, context.out.passing()
    name = () if node.name is None else (node.name.key,)
    operands = (0.0 if node.priority is None else node.priority.value, *name)
    watch = out.emit(Op.WHEN, LATER, truth, LATER, *operands, span=node.head)
    context.watches.append(watch)
    over = out.emit(Op.JMP, LATER, span=node.head)
    condition = out.here
    out.value(node.condition, truth)
    out.emit(Op.RET, span=node.head)
    action = out.here
    context.generate_with(node.action, in_action=False)
    out.emit(Op.RET, span=node.action.span)
    out.instructions[watch] = attrs.evolve(out.instructions[watch], operands=(condition, truth, action, *operands))
    out.patch_jump(over)


def lock(context: Context, node: tree.Lock) -> None:
    """Generate a body between LOCK and UNLK of the same variables."""
    locked = [context.out.value(target) for target in node.targets]
    context.out.emit(Op.LOCK, *locked, span=node.head)
    context.generate(node.body)
    context.out.emit(Op.UNLK, *locked, span=node.head)


def try_(context: Context, node: tree.Try) -> None:
    """Generate both parts of a TRY."""
    out = context.out
    kinds = (kind.key for kind in node.kinds if isinstance(kind, tree.Name))
    attempt = out.emit(Op.TRY, LATER, *kinds, span=node.span)
    context.generate_list(*node.body)
    succeeded = out.emit(Op.ENDT, LATER, span=node.span)
    out.patch_jump(attempt)
    context.generate_list(*node.recovery)
    out.emit(Op.ENDR, span=node.span)
    out.patch_jump(succeeded)


def halt(context: Context, node: tree.Halt) -> None:
    """Generate one HALT: of the MOVE in an action, else of the program."""
    context.out.emit(Op.MVHLT if context.in_action else Op.HALT, span=node.span)


def raise_(context: Context, node: tree.Raise) -> None:
    """Generate one RAISE."""
    text = () if node.text is None else (context.out.value(node.text),)
    context.out.emit(Op.RAISE, node.kind.key, *text, span=node.span)


def call(context: Context, node: tree.Call) -> None:
    """Generate the arguments of a call, then the call."""
    values = [context.out.value(argument) for argument in node.arguments]
    context.out.emit(Op.CALL, node.name.key, *values, span=node.span)


GENERATORS: Generators = {
    tree.Block: block,
    tree.If: if_,
    tree.While: while_,
    tree.Repeat: repeat,
    tree.For: for_,
    tree.Cobegin: cobegin,
    tree.Signal: one_instruction(Op.SIG),
    tree.Wait: wait,
    tree.WaitUntil: wait_until,
    tree.Pause: one_instruction(Op.PAUSE),
    tree.When: when,
    tree.WatchSwitch: lambda context, node: context.out.emit(
        Op.WHSET, node.name.key, "ON" if node.on else "OFF", span=node.span
    ),
    tree.Brake: one_instruction(Op.BRAKE),
    tree.Resume: one_instruction(Op.RESUME),
    tree.Lock: lock,
    tree.Try: try_,
    tree.Retry: one_instruction(Op.RETRY),
    tree.Halt: halt,
    tree.Raise: raise_,
    tree.Return: one_instruction(Op.RETV),
    tree.Call: call,
}
