"""MOVE: the types of what it moves, its goal and its clauses, and which clauses go together."""

from armwright.program.language.diagnostic import labels
from armwright.program.language.source import Span
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, Dimension
from armwright.program.semantics.builtins import is_joints, joint_target
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType, expression_text, quote_expression
from armwright.program.semantics.quantities import check_range, check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.type_check import require_condition, require_quantity, require_type
from armwright.program.syntax import tree

# What a clause gives, and what stands against it where DIRECTLY is given.
_CONFLICTS_WITH_DIRECTLY: dict[type, tuple[str, str]] = {
    tree.Straightly: ("a straight line asked for here", "requests one motion of the joints to the goal"),
    tree.Circularly: ("an arc asked for here", "requests one motion of the joints to the goal"),
    tree.Via: ("via points given here", "allows no via points"),
    tree.Approach: ("approach point given here", "allows no approach point"),
    tree.Departure: ("departure point given here", "allows no departure point"),
}
SPEED_NOTE = "100 is the normal speed and 120 the maximum of the arm"


def move(context: Context, node: tree.Move) -> None:
    """Check one MOVE."""
    names = context.names
    _check_queue(context, node)
    _check_correction(names, node)
    require_type(names, node.moved, ExpressionType.FRAME, "E215", "MOVE moves an arm or a FRAME")
    if isinstance(node.goal, tree.Function) and is_joints(names.scope, node.goal):
        _check_joints(names, node, node.goal)
    else:
        check_pose(names, node.goal, "E211", "a MOVE must go to a FRAME", node)
    _check_combination(names, node.clauses)
    for clause in node.clauses:
        match clause:
            case tree.Via(points=points):
                for point in points:
                    check_pose(names, point, "E212", "a via point must be a FRAME")
            case tree.Approach(point=point) | tree.Departure(point=point):
                article = "an approach" if isinstance(clause, tree.Approach) else "a departure"
                check_pose(names, point, "E215", f"{article} point must be a FRAME")
            case tree.Speed(value=value):
                check_speed(names, value)
            case tree.Blend() | tree.Duration() | tree.Velocity() | tree.Rotation() | tree.Acceleration():
                check_quantity(names, clause, clause.value)
            case tree.Tracking(point=point):
                _check_tracking(names, node, clause, point)
            case tree.On(condition=wanted, action=action, head=head):
                _check_guard_place(names, node, head)
                require_condition(names, wanted, "ON")
                context.check_with(action, recovering=False)


def _check_queue(context: Context, node: tree.Move) -> None:
    """Report a MOVE of an arm that runs along its queue."""
    queue = context.queues.get(node.moved.key) if isinstance(node.moved, tree.ArmName) else None
    if queue is not None:
        arm = expression_text(node.moved)
        text, here = f"{arm} cannot make a MOVE in its QUEUE", labels(queue.head, "its queue is open from here on")
        advice = f"write `PUT ... TO {arm}`, or the MOVE behind the QUEUE"
        context.names.report("E256", text, node.span, "it runs along its queue", secondary=here, advice=advice)


def check_pose(names: NameResolver, node: tree.Expression, code: str, what: str, move: tree.Move | None = None) -> None:
    """Check a frame to come to."""

    def advice(actual: ExpressionType) -> str:
        if move is None or actual is not ExpressionType.TRANS:
            return ""
        moved = "ARM_1" if isinstance(move.moved, tree.Poison) else expression_text(move.moved)
        step = expression_text(node)
        return f"to move by `{step}` from the present pose write `MOVE {moved} TO {moved} * {step}`"

    require_type(names, node, ExpressionType.FRAME, code, what, advice=advice)


# What a goal that goes with a moving frame has nothing to do with: the tool goes there straight, and on with it.
_CONFLICTS_WITH_TRACKING = (
    *(tree.Directly, tree.Circularly, tree.Via, tree.Approach, tree.Departure, tree.Blend),
    *tree.TOOL_LIMITS,
)


def _check_tracking(names: NameResolver, node: tree.Move, clause: tree.Clause, frame: tree.Expression) -> None:
    """Check a MOVE that tracks a frame: it names one, and does nothing else on its way."""
    is_frame = require_type(names, frame, ExpressionType.FRAME, "E215", "TRACKING needs a frame that moves")
    if is_frame and not isinstance(frame, tree.Name | tree.Poison):
        text = f"TRACKING needs the name of a frame that moves, not {quote_expression(frame)}"
        advice = "affix what the MOVE goes to to that frame, and name the frame here"
        names.report("E248", text, frame.span, "this is no name of a frame", advice=advice)
    if isinstance(node.goal, tree.Function) and is_joints(names.scope, node.goal):
        text, here = "joint positions do not go with a frame", labels(clause.span, "a frame is tracked here")
        names.report("E248", text, node.goal.span, "these stand", secondary=here, advice="leave TRACKING out")
    for other in node.clauses:
        if isinstance(other, _CONFLICTS_WITH_TRACKING):
            text = f"TRACKING cannot be combined with {tree.clause_word(type(other))}"
            here, advice = labels(clause.span, "a frame is tracked here"), "write a MOVE of its own for the other leg"
            names.report("E248", text, other.span, "another way, or another speed", secondary=here, advice=advice)


# What a path that is corrected on a straight line has nothing to do with.
_CONFLICTS_WITH_CORRECTION = (
    *(tree.Directly, tree.Circularly, tree.Via, tree.Approach, tree.Departure, tree.Blend, tree.Tracking),
)


def _check_correction(names: NameResolver, node: tree.Move) -> None:
    """Check a MOVE whose path a sensor corrects: a line, with a bound and a rate."""
    given = {type(clause): clause for clause in node.clauses}
    correction = given.get(tree.Correction)
    limits = [given[kind] for kind in (tree.Bound, tree.Rate) if kind in given]
    for clause in limits:
        if isinstance(clause, tree.Bound | tree.Rate):
            check_quantity(names, clause, clause.value)
        if correction is None:
            text, advice = f"{tree.clause_word(type(clause))} is of a MOVE with CORRECTION", "leave it out"
            names.report("E257", text, clause.span, "nothing is corrected", advice=advice)
    if not isinstance(correction, tree.Correction):
        return
    require_quantity(names, correction.value, "length", "CORRECTION needs a length")
    missing = [tree.clause_word(kind) for kind in (tree.Bound, tree.Rate) if kind not in given]
    if missing:
        advice = f"write `{', '.join(f'WITH {word} = ...' for word in missing)}` too"
        names.report("E257", f"CORRECTION needs {' and '.join(missing)}", correction.span, "how far?", advice=advice)
    if tree.Straightly not in given:
        text, advice = "CORRECTION needs a straight line", "write STRAIGHTLY"
        names.report("E257", text, correction.span, "beside which line?", advice=advice)
    for other in node.clauses:
        if isinstance(other, _CONFLICTS_WITH_CORRECTION):
            text = f"CORRECTION cannot be combined with {tree.clause_word(type(other))}"
            here, advice = labels(correction.span, "corrected here"), "write a MOVE of its own for the other leg"
            names.report("E257", text, other.span, "another way", secondary=here, advice=advice)


# What is not shaped: the way past other frames, and what is worked out while the arm moves.
_CONFLICTS_WITH_SMOOTHLY: dict[type, str] = {
    tree.Circularly: "write a MOVE of its own for the arc",
    tree.Via: "write one MOVE SMOOTHLY for each leg, at whose end the arm stops",
    tree.Blend: "leave BLEND out, so that the arm stops at the goal",
    tree.Tracking: "leave SMOOTHLY out: the goal moves on when it is reached",
    tree.Correction: "leave SMOOTHLY out: what a sensor asks for on the way is not known before",
}


def no_flexible_gear(arm: str) -> tuple[str, str]:
    """Return what is to be said of a MOVE SMOOTHLY of an arm with rigid gears, and the advice."""
    text = f"{arm} has no flexible gear, so SMOOTHLY has nothing to shape"
    return text, f"give stiffness_Nm_per_rad in the arm file or in `[arms.{arm}.smooth]` of the cell"


def no_flat_line(arm: str) -> tuple[str, str]:
    """Return what is to be said of a MOVE SMOOTHLY by flat feedforward along a straight line, and the advice."""
    text = f"the shaper of {arm} is flat feedforward, which shapes motions of the joints and no straight line"
    advice = "write a MOVE of its own for the line, STRAIGHTLY and without SMOOTHLY"
    return text, f"{advice}, or choose zvd in `[arms.{arm}.smooth]` of the cell"


def _check_smooth(names: NameResolver, first: dict[type, tree.Clause]) -> None:
    """Check that a MOVE that is shaped goes a way that can be."""
    smooth = first.get(tree.Smoothly)
    for kind, advice in _CONFLICTS_WITH_SMOOTHLY.items():
        clause = first.get(kind)
        if smooth is not None and clause is not None:
            text = f"SMOOTHLY cannot be combined with {tree.clause_word(kind)}"
            here = labels(smooth.span, "shaped against vibrations here")
            names.report("E258", text, clause.span, "is not shaped", secondary=here, advice=advice)
            return


# What JOINTS as a goal has nothing to do with: only the joints know where they go.
_CONFLICTS_WITH_JOINTS = (tree.Straightly, tree.Circularly, tree.Via, tree.Approach)


def _check_guard_place(names: NameResolver, node: tree.Move, head: Span) -> None:
    """Report a guard of a MOVE that goes over into the next one."""
    kinds = {type(clause): clause for clause in node.clauses}
    if tree.Blend in kinds and tree.Via not in kinds:
        text, here = (
            "a MOVE that goes over into the next one has no guard",
            labels(kinds[tree.Blend].span, "BLEND here"),
        )
        advice = "leave BLEND out, so that the MOVE ends at its goal"
        names.report("E226", text, head, "until when?", secondary=here, advice=advice)


def _check_joints(names: NameResolver, node: tree.Move, goal: tree.Function) -> None:
    """Check a goal that is given by joint positions: what goes to it, and how."""
    if joint_target(names.scope, goal) is None:
        if not goal.arguments:
            names.report("E246", "JOINTS takes a position for each joint", goal.span, "no positions here")
        for argument in goal.arguments:
            require_type(names, argument, ExpressionType.SCALAR, "E216", "a joint position is a number")
    if not isinstance(node.moved, tree.ArmName | tree.Poison):
        text = f"JOINTS is a goal for an arm, not for {quote_expression(node.moved)}"
        advice = "move the arm that carries it"
        names.report("E245", text, node.moved.span, "this is not an arm", advice=advice)
    for clause in node.clauses:
        if isinstance(clause, _CONFLICTS_WITH_JOINTS):
            word = tree.clause_word(type(clause))
            text, here = f"{word} cannot be combined with JOINTS", labels(goal.span, "joint positions given here")
            advice = "let one MOVE go to a frame, and the next to JOINTS"
            names.report("E245", text, clause.span, "asks for a path of the tool", secondary=here, advice=advice)


def check_speed(names: NameResolver, node: tree.Expression) -> None:
    """Check that a SPEED is a number without a unit, one in the range of speeds where it is written."""
    is_number = require_type(names, node, ExpressionType.SCALAR, "E216", "SPEED needs a number or a SCALAR")
    if not is_number or not isinstance(node, tree.Number) or not check_unit(names, node, None, "a speed has no unit"):
        return
    # A number that was reported before is NaN and in no range, nor out of it.
    if node.value < LOWEST_SPEED or node.value > HIGHEST_SPEED:
        text = f"speed {node.text} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
        names.report("E207", text, node.span, "out of range", note=SPEED_NOTE)


# Clauses that are quantities: what each measures, with the unit of the program, and what it needs in words.
_QUANTITIES: dict[type, tuple[Dimension, str]] = {
    tree.Blend: ("length", "a length"),
    tree.Duration: ("time", "a time"),
    tree.Velocity: ("length", "a length per second"),
    tree.Rotation: ("angle", "an angle per second"),
    tree.Acceleration: ("length", "a length per second squared"),
    tree.Bound: ("length", "a length"),
    tree.Rate: ("length", "a length per second"),
}


def check_quantity(names: NameResolver, clause: tree.Clause, value: tree.Expression) -> None:
    """Check a clause that is a quantity: a number above 0, whose unit fits where it has one."""
    (required, needs), word = _QUANTITIES[type(clause)], tree.clause_word(type(clause))
    if require_quantity(names, value, required, f"{word} needs {needs}"):
        check_range(names, value, f"{'an' if word == 'ACCELERATION' else 'a'} {word}", zero=False)


def _check_combination(names: NameResolver, clauses: tuple[tree.Clause, ...]) -> None:
    """Check that no clause is given twice, and that those given go together."""
    first: dict[type, tree.Clause] = {}
    for clause in clauses:
        # A motion may be guarded by several conditions.
        if isinstance(clause, tree.On):
            continue
        if (earlier := first.setdefault(type(clause), clause)) is not clause:
            text = f"{tree.clause_word(type(clause))} is given twice in one MOVE"
            names.report("E213", text, clause.span, "second", secondary=labels(earlier.span, "first"))
    if (circular := first.get(tree.Circularly)) is not None:
        _check_arc(names, circular, first)
    _check_smooth(names, first)
    if len(first) > 1 or tree.Blend in first:
        _check_paths(names, first)
        check_durations(names, first)


def _check_arc(names: NameResolver, circular: tree.Clause, first: dict[type, tree.Clause]) -> None:
    """Check that an arc has one frame to pass, and no other way to go."""
    via = first.get(tree.Via)
    if not isinstance(via, tree.Via):
        advice = "write `CIRCULARLY, VIA (f)` with a frame on the arc"
        names.report("E247", "CIRCULARLY needs a frame to pass", circular.span, "an arc through what?", advice=advice)
    elif len(via.points) > 1:
        text, here = f"an arc passes one frame, not {len(via.points)}", labels(circular.span, "an arc asked for here")
        advice = "write one `MOVE ... CIRCULARLY` for each arc"
        names.report("E247", text, via.span, f"{len(via.points)} frames", secondary=here, advice=advice)
    for kind in (tree.Straightly, tree.Approach, tree.Departure, tree.Blend):
        if clause := first.get(kind):
            text = f"CIRCULARLY cannot be combined with {tree.clause_word(kind)}"
            here = labels(circular.span, "requests one arc")
            advice = "write a MOVE for the arc, and one for each other leg"
            names.report("E247", text, clause.span, "another way", secondary=here, advice=advice)


def _check_paths(names: NameResolver, first: dict[type, tree.Clause]) -> None:
    direct, straight, blend = first.get(tree.Directly), first.get(tree.Straightly), first.get(tree.Blend)
    for kind, clause in first.items():
        label, against = _CONFLICTS_WITH_DIRECTLY.get(kind, ("", ""))
        combined = f"cannot be combined with {tree.clause_word(kind)}"
        if direct and label:
            here, advice = labels(direct.span, against), "remove one of the two"
            names.report("E208", f"DIRECTLY {combined}", clause.span, label, secondary=here, advice=advice)
        elif straight and tree.Circularly not in first and kind in (tree.Via, tree.Approach, tree.Departure):
            here = labels(straight.span, "requests one straight line")
            advice = "write one `MOVE ... STRAIGHTLY` for each leg"
            names.report("E209", f"STRAIGHTLY {combined}", clause.span, label, secondary=here, advice=advice)
    if blend and tree.Via not in first and tree.Circularly not in first:
        _check_going_over(names, blend, first)


def _check_going_over(names: NameResolver, blend: tree.Clause, first: dict[type, tree.Clause]) -> None:
    """Check a BLEND without VIA: a MOVE of one stage goes over into the next one."""
    if tree.Approach in first or tree.Departure in first:
        text = "BLEND rounds the corners at via points, but there is no VIA"
        advice = "add `VIA ( ... )`, or write a MOVE for each leg, which goes over into the next one"
        names.report("E226", text, blend.span, "no corners to round", advice=advice)
    elif (duration := first.get(tree.Duration)) is not None:
        text = "a MOVE that goes over into the next one has no DURATION of its own"
        here = labels(blend.span, "it goes over into the next one")
        advice = "write SPEED or VELOCITY"
        names.report("E226", text, duration.span, "of which part?", secondary=here, advice=advice)


def check_durations(names: NameResolver, first: dict[type, tree.Clause]) -> None:
    """Check that one clause alone tells how long a motion takes, of those given, by their kinds."""
    for kinds in ((tree.Speed, tree.Duration), (tree.Speed, tree.Velocity), (tree.Velocity, tree.Duration)):
        given = [clause for clause in map(first.get, kinds) if clause is not None]
        if len(given) < len(kinds):
            continue
        earlier, later = sorted(given, key=lambda clause: clause.span.start)
        first_word, word = tree.clause_word(type(earlier)), tree.clause_word(type(later))
        text = f"{tree.clause_word(kinds[0])} cannot be combined with {tree.clause_word(kinds[1])}"
        here = labels(earlier.span, f"{first_word} given here")
        note, advice = "each of them determines the duration of the motion", "remove one of the two"
        names.report("E230", text, later.span, f"{word} given here", secondary=here, note=note, advice=advice)


CHECKS: Checks = {tree.Move: move}
