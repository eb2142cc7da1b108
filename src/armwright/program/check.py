"""Names and types: every name declared once and used as what it is; clauses that go together; values in range."""

from armwright.errors import closest
from armwright.program import moves, tree
from armwright.program.code import Kind
from armwright.program.diagnostics import Diagnostic
from armwright.program.known import WORLD, KnownCell
from armwright.program.matrices import check as check_matrix
from armwright.program.names import Names, Symbols


def check(program: tree.Program, cell: KnownCell | None = None) -> tuple[Symbols, list[Diagnostic]]:
    """Return the names of a program, and what is wrong with names, types, clauses and values."""
    names = Names(cell)
    for declaration in program.declarations:
        names.declare(declaration)
    for statement in program.statements:
        _statement(names, statement)
    names.unused()
    return names.symbols, names.found


def _statement(names: Names, statement: tree.Statement) -> None:
    """Check one statement."""
    match statement:
        case tree.Init():
            _init(names, statement)
        case tree.Affix():
            _affix(names, statement)
        case tree.Unfix(child=child, parent=parent):
            _child(names, child, "UNFIX cuts", "unfixed", ())
            names.need(parent, Kind.FRAME, "E215", "FROM needs a FRAME or an arm")
        case tree.Move():
            moves.check(names, statement)
        case tree.Poison():
            names.mention(statement.names)
        case _:
            _tool_or_sensor(names, statement)


def _tool_or_sensor(names: Names, statement: tree.Statement) -> None:
    match statement:
        case tree.Open(arm=arm):
            _arm(names, arm, "OPEN")
        case tree.Grasp(arm=arm):
            _arm(names, arm, "GRASP")
        case tree.ReadSystem(arm=arm):
            _arm(names, arm, "READ SYSTEM")
        case tree.ReadVisions(target=target):
            _target(names, target)
        case tree.Operate(device=tree.ArmName() as arm):
            names.found.say("E201", f"OPERATE starts a device, but `{arm.text}` is an arm", arm.span, "an arm")
        case _:
            pass


def _init(names: Names, init: tree.Init) -> None:
    name, value = init.name, init.value
    if isinstance(value, tree.Poison):
        # The variable keeps its kind; only what it holds is unknown. What stands on the right counts as used.
        names.use(value.names)
    if isinstance(name, tree.ArmName):
        help_ = f"move it, or write `READ SYSTEM ({name.key})`"
        names.found.say(
            "E218", f"`{name.text}` is an arm and cannot be given a value", name.span, "an arm", helps=(help_,)
        )
        return
    kind = names.kind(name)
    if name.key == WORLD:
        names.found.say("E218", f"`{name.text}` cannot be given a value", name.span, "the root of all frames")
    elif kind is not None and not isinstance(value, tree.Poison):
        _fits(names, name, kind, value)


def _fits(names: Names, name: tree.Name, kind: Kind, value: tree.Matrix | tree.Number) -> None:
    """Check that a scalar gets one number, anything else twelve that make a place."""
    is_matrix = isinstance(value, tree.Matrix)
    if is_matrix == (kind is Kind.SCALAR):
        takes = "one number" if kind is Kind.SCALAR else "twelve numbers in `( )`"
        names.found.say(
            "E217",
            f"`{name.text}` is a {kind} and takes {takes}",
            value.span,
            "a matrix" if is_matrix else "one number",
            secondary=names.where_declared(name.key),
        )
        names.poisoned.add(name.key)
    elif isinstance(value, tree.Matrix) and (fault := check_matrix(value)):
        names.found.append(fault)


def _affix(names: Names, affix: tree.Affix) -> None:
    child, parent, at = affix.child, affix.parent, affix.at
    swap = isinstance(parent, tree.Name) and isinstance(child, tree.ArmName)
    helps = (f"did you mean `AFFIX {_text(parent)} TO {_text(child)}`?",) if swap else ()
    _child(names, child, "AFFIX hangs", "affixed to a frame", helps)
    names.need(parent, Kind.FRAME, "E215", "AFFIX ... TO needs a FRAME or an arm")
    if at is None:
        return
    is_frame = isinstance(at, tree.Name) and names.kinds.get(at.key) is Kind.FRAME
    whence, where = _text(parent), _text(at)
    names.need(
        at,
        Kind.TRANS,
        "E210",
        "AT needs a TRANS",
        notes=("a FRAME is a place in the cell; a TRANS is the step from one frame to another",),
        helps=(f"for the step from {whence} to {where} write `AT INV({whence}) * {where}`",) if is_frame else (),
    )


def _text(node: tree.Mobile) -> str:
    return "..." if isinstance(node, tree.Poison) else node.text


def _child(names: Names, child: tree.Mobile, verb: str, done: str, helps: tuple[str, ...]) -> None:
    """Check the frame that AFFIX hangs or UNFIX cuts."""
    if isinstance(child, tree.ArmName):
        text = f"an arm cannot be {done}"
        names.found.say("E308", text, child.span, "an arm hangs on its own base", helps=helps)
    elif isinstance(child, tree.Name) and child.key == WORLD:
        names.found.say(
            "E309", f"`{child.text}` cannot be {done.partition(' ')[0]}", child.span, "the root of all frames"
        )
    else:
        names.need(child, Kind.FRAME, "E215", f"{verb} a FRAME")


def _target(names: Names, target: tree.Mobile) -> None:
    if isinstance(target, tree.ArmName):
        help_ = f"write `READ SYSTEM ({target.key})` to read the arm"
        text = f"READ VISIONS finds a FRAME, but `{target.text}` is an arm"
        names.found.say("E215", text, target.span, "an arm", helps=(help_,))
    elif isinstance(target, tree.Name) and target.key == WORLD:
        names.found.say("E218", f"`{target.text}` cannot be given a value", target.span, "the root of all frames")
    else:
        names.need(target, Kind.FRAME, "E215", "READ VISIONS finds a FRAME")


def _arm(names: Names, node: tree.Mobile | None, who: str) -> None:
    if not isinstance(node, tree.Name):
        return
    names.use([node.key])
    if node.key in names.poisoned:
        return
    near = closest(node.text, names.arms())
    kind = names.kinds.get(node.key)
    is_what = f"is a {kind}" if kind else "is no arm"
    names.found.say(
        "E201",
        f"{who} needs an arm, but `{node.text}` {is_what}",
        node.span,
        str(kind or "not an arm"),
        secondary=names.where_declared(node.key),
        helps=(f"did you mean `{near}`?",) if near else (f"write the name of an arm, such as `{names.arms()[0]}`",),
    )
