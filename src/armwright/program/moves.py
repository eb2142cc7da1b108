"""Names, types and clauses of one MOVE."""

from armwright.program import tree
from armwright.program.code import HIGHEST_SPEED, LOWEST_SPEED, Kind
from armwright.program.diagnostics import Label
from armwright.program.names import Names

_WORDS: dict[type, str] = {
    tree.Directly: "DIRECTLY",
    tree.Straightly: "STRAIGHTLY",
    tree.Via: "VIA",
    tree.Approach: "APPROACH",
    tree.Departure: "DEPARTURE",
    tree.Speed: "SPEED",
}
_GIVEN: dict[type, str] = {
    tree.Straightly: "a straight line asked for here",
    tree.Via: "via points given here",
    tree.Approach: "approach point given here",
    tree.Departure: "departure point given here",
}
_NOT_ASKED: dict[type, str] = {
    tree.Straightly: "asks for the shortest way of the joints",
    tree.Via: "asks for no via points",
    tree.Approach: "asks for no approach point",
    tree.Departure: "asks for no departure point",
}
SPEED_NOTE = "100 is the normal speed and 120 the largest the arm allows"


def check(names: Names, move: tree.Move) -> None:
    """Check one MOVE."""
    names.need(move.moved, Kind.FRAME, "E215", "MOVE moves an arm or a FRAME")
    moved = move.moved.text if not isinstance(move.moved, tree.Poison) else "ARM_1"
    is_trans = isinstance(move.goal, tree.Name) and names.kinds.get(move.goal.key) is Kind.TRANS
    by = (
        f"to move by `{move.goal.text}` from the present place write `MOVE {moved} TO {moved} * {move.goal.text}`"
        if isinstance(move.goal, tree.Name)
        else ""
    )
    _place(names, move.goal, "E211", "a MOVE must go to a FRAME", (by,) if is_trans else ())
    _combination(names, move.clauses)
    for clause in move.clauses:
        match clause:
            case tree.Via(points=points):
                for point in points:
                    _place(names, point, "E212", "a via point must be a FRAME")
            case tree.Approach(point=point):
                _place(names, point, "E215", "an approach point must be a FRAME")
            case tree.Departure(point=point):
                _place(names, point, "E215", "a departure point must be a FRAME")
            case tree.Speed(value=tree.Number() as number):
                _speed(names, number)
            case tree.Speed(value=tree.Name() | tree.ArmName() | tree.Poison() as scalar):
                names.need(scalar, Kind.SCALAR, "E216", "SPEED needs a number or a SCALAR")
            case _:
                pass


def _place(names: Names, node: tree.Mobile, code: str, what: str, helps: tuple[str, ...] = ()) -> None:
    """Check a frame to come to; an arm as one is an expression of RLO-2."""
    if isinstance(node, tree.ArmName):
        names.found.say(
            "E214", f"`{node.text}` as a place belongs to RLO-2", node.span, "RLO-83 takes the name of a FRAME here"
        )
    else:
        names.need(node, Kind.FRAME, code, what, helps=helps)


def _speed(names: Names, number: tree.Number) -> None:
    # A number that was reported before is NaN and in no range, nor out of it.
    if number.value < LOWEST_SPEED or number.value > HIGHEST_SPEED:
        names.found.say(
            "E207",
            f"speed {number.text} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}",
            number.span,
            "out of range",
            notes=(SPEED_NOTE,),
        )


def _combination(names: Names, clauses: tuple[tree.Clause, ...]) -> None:
    """Check that no clause is given twice, and that those given go together."""
    first: dict[type, tree.Clause] = {}
    for clause in clauses:
        if (earlier := first.setdefault(type(clause), clause)) is not clause:
            names.found.say(
                "E213",
                f"{_WORDS[type(clause)]} is given twice in one MOVE",
                clause.span,
                "second",
                secondary=(Label(earlier.span, "first"),),
            )
    direct, straight = first.get(tree.Directly), first.get(tree.Straightly)
    for kind, clause in first.items():
        if direct and kind in _NOT_ASKED:
            names.found.say(
                "E208",
                f"DIRECTLY cannot be combined with {_WORDS[kind]}",
                clause.span,
                _GIVEN[kind],
                secondary=(Label(direct.span, _NOT_ASKED[kind]),),
                helps=("remove one of the two",),
            )
        elif straight and kind in (tree.Via, tree.Approach, tree.Departure):
            names.found.say(
                "E209",
                f"STRAIGHTLY cannot be combined with {_WORDS[kind]}",
                clause.span,
                _GIVEN[kind],
                secondary=(Label(straight.span, "asks for one straight line"),),
                helps=("write one `MOVE ... STRAIGHTLY` for each leg",),
            )
