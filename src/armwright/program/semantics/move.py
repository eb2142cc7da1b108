"""Names, types and clauses of one MOVE."""

from armwright.program.language.diagnostic import labels
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, Dimension
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType, written
from armwright.program.semantics.quantities import in_range, measure
from armwright.program.semantics.scopes import Names
from armwright.program.semantics.type_check import condition, need, quantity
from armwright.program.syntax import tree

# What a clause gives, and what stands against it where DIRECTLY is given.
_NOT_DIRECTLY: dict[type, tuple[str, str]] = {
    tree.Straightly: ("a straight line asked for here", "requests one motion of the joints to the goal"),
    tree.Via: ("via points given here", "allows no via points"),
    tree.Approach: ("approach point given here", "allows no approach point"),
    tree.Departure: ("departure point given here", "allows no departure point"),
    tree.Blend: ("rounded corners asked for here", "has no corners"),
}
SPEED_NOTE = "100 is the normal speed and 120 the maximum of the arm"


def move(context: Context, node: tree.Move) -> None:
    """Check one MOVE."""
    names = context.names
    need(names, node.moved, ExpressionType.FRAME, "E215", "MOVE moves an arm or a FRAME")
    _pose(names, node.goal, "E211", "a MOVE must go to a FRAME", node)
    _combination(names, node.clauses)
    for clause in node.clauses:
        match clause:
            case tree.Via(points=points):
                for point in points:
                    _pose(names, point, "E212", "a via point must be a FRAME")
            case tree.Approach(point=point):
                _pose(names, point, "E215", "an approach point must be a FRAME")
            case tree.Departure(point=point):
                _pose(names, point, "E215", "a departure point must be a FRAME")
            case tree.Speed(value=value):
                _speed(names, value)
            case tree.Blend() | tree.Duration():
                _amount(names, clause)
            case tree.On(condition=wanted, action=action):
                condition(names, wanted, "ON")
                context.check_concurrent(action)
            case _:
                pass


def _pose(names: Names, node: tree.Expression, code: str, what: str, move: tree.Move | None = None) -> None:
    """Check a frame to come to."""

    def advice(actual: ExpressionType) -> str:
        if move is None or actual is not ExpressionType.TRANS:
            return ""
        moved = "ARM_1" if isinstance(move.moved, tree.Poison) else written(move.moved)
        step = written(node)
        return f"to move by `{step}` from the present pose write `MOVE {moved} TO {moved} * {step}`"

    need(names, node, ExpressionType.FRAME, code, what, advice=advice)


def _speed(names: Names, node: tree.Expression) -> None:
    if not need(names, node, ExpressionType.SCALAR, "E216", "SPEED needs a number or a SCALAR"):
        return
    if not isinstance(node, tree.Number) or not measure(names, node, None, "a speed has no unit"):
        return
    # A number that was reported before is NaN and in no range, nor out of it.
    if node.value < LOWEST_SPEED or node.value > HIGHEST_SPEED:
        text = f"speed {node.text} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
        names.report("E207", text, node.span, "out of range", note=SPEED_NOTE)


def _amount(names: Names, clause: tree.Blend | tree.Duration) -> None:
    wants: Dimension = "length" if isinstance(clause, tree.Blend) else "time"
    what = tree.clause_word(type(clause))
    if quantity(names, clause.value, wants, f"{what} needs a {wants}"):
        in_range(names, clause.value, f"a {what}", zero=False)


def _combination(names: Names, clauses: tuple[tree.Clause, ...]) -> None:
    """Check that no clause is given twice, and that those given go together."""
    first: dict[type, tree.Clause] = {}
    for clause in clauses:
        # A motion may be guarded by several conditions.
        if isinstance(clause, tree.On):
            continue
        if (earlier := first.setdefault(type(clause), clause)) is not clause:
            text = f"{tree.clause_word(type(clause))} is given twice in one MOVE"
            names.report("E213", text, clause.span, "second", secondary=labels(earlier.span, "first"))
    if len(first) > 1 or tree.Blend in first:
        _ways(names, first)
        _times(names, first)


def _ways(names: Names, first: dict[type, tree.Clause]) -> None:
    direct, straight, blend = first.get(tree.Directly), first.get(tree.Straightly), first.get(tree.Blend)
    for kind, clause in first.items():
        if direct and kind in _NOT_DIRECTLY:
            label, against = _NOT_DIRECTLY[kind]
            text, here = f"DIRECTLY cannot be combined with {tree.clause_word(kind)}", labels(direct.span, against)
            names.report("E208", text, clause.span, label, secondary=here, advice="remove one of the two")
        elif straight and kind in (tree.Via, tree.Approach, tree.Departure):
            text, (label, _) = f"STRAIGHTLY cannot be combined with {tree.clause_word(kind)}", _NOT_DIRECTLY[kind]
            here = labels(straight.span, "requests one straight line")
            advice = "write one `MOVE ... STRAIGHTLY` for each leg"
            names.report("E209", text, clause.span, label, secondary=here, advice=advice)
    if blend and not direct and tree.Via not in first:
        text = "BLEND rounds the corners at via points, but there is no VIA"
        names.report("E226", text, blend.span, "no corners to round", advice="add `VIA ( ... )`, or leave BLEND out")


def _times(names: Names, first: dict[type, tree.Clause]) -> None:
    speed, duration = first.get(tree.Speed), first.get(tree.Duration)
    if speed and duration:
        earlier, later = sorted((speed, duration), key=lambda clause: clause.span.start)
        first_word, word = tree.clause_word(type(earlier)), tree.clause_word(type(later))
        text, here = "SPEED cannot be combined with DURATION", labels(earlier.span, f"{first_word} given here")
        note, advice = "each of them determines the duration of the motion", "remove one of the two"
        names.report("E230", text, later.span, f"{word} given here", secondary=here, note=note, advice=advice)


CHECKS: Checks = {tree.Move: move}
