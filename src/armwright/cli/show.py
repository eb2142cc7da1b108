"""``armwright show``: the tables of an arm."""

import math
from typing import TYPE_CHECKING, Any

from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rich.table import Table

    from armwright.arm.model import Arm, Joint

# Width at which tables are measured [characters]; none is wider.
_WIDEST = 200
# The origin of the gravity vector, in words.
_GRAVITY_FROM = {
    "standard": "the default; in a cell, that of the cell",
    "stated": "stated by the arm; in a cell, that of the cell",
    "root": "down in the root link of the file; in a cell, that of the cell",
    "world": "that of the cell",
}
# Parameters of a drive that affect the motion of the joint.
_DRIVE = ("inertia", "viscous", "coulomb_forward", "coulomb_backward")


def show(arm: ArmName, as_json: Json = False) -> None:
    """Print the Denavit-Hartenberg, limit, inertia and drive tables of an arm.

    The tables are in degrees and millimetres; --json prints SI units and radians.

    **Example:** `armwright show puma560`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.terminal import console as clean_console

    model = load_arm(arm)
    if as_json:
        print_json(_as_data(model))
        return
    console = clean_console(highlight=False, emoji=False)
    console.print(f"{model.name}: {model.title}" if model.title else model.name, style="bold")
    if model.source:
        console.print(model.source, style="dim")
    for title, table in _tables(model):
        console.print()
        console.print(title, style="bold")
        if table:
            # A narrow terminal wraps lines; it must not truncate numbers.
            width = console.measure(table, options=console.options.update(max_width=_WIDEST)).maximum
            clean_console(highlight=False, width=max(width, console.width)).print(table)
    console.print()
    console.print(_facts(model))


def _tables(model: "Arm") -> "Iterator[tuple[str, Table | None]]":
    """Yield every table with its title; a title alone states that there are no data."""
    if any(joint.name or link.name for joint, link in zip(model.joints, model.links, strict=True)):
        yield "Names", _names(model)
    yield "Denavit-Hartenberg, standard", _geometry(model)
    if any(joint.fixed is not None for joint in model.joints):
        yield "Fixed transforms, after theta and d and before a and alpha", _fixed(model)
    yield "Limits", _limits(model)
    unknown = [f"link {i}: {link.unknown}" for i, link in enumerate(model.links, 1) if link.unknown]
    if unknown:
        yield f"Mass and inertia are unknown, so there is no dynamics. {'; '.join(unknown)}", None
    if any(link.mass or link.inertia.any() for link in model.links):
        yield "Links: mass, and centre of mass in the frame of the link", _links(model)
        yield "Inertia about the centre of mass, kg m²", _inertia(model)
    else:
        yield "Links: no masses or inertias are known", None
    if any(any(getattr(motor, name) for name in _DRIVE) for motor in model.motors):
        yield "Drives, reflected to the joint", _motors(model)
    else:
        yield "Drives: no inertia or friction is known", None


def _table(columns: "Sequence[str]", rows: "Iterable[Sequence[str]]") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table


def _fixed(model: "Arm") -> "Table":
    from armwright.spatial.euler import to_rpy

    rows = []
    for i, joint in enumerate(model.joints, 1):
        if joint.fixed is not None:
            position = (f"{x * 1e3:z.6g}" for x in joint.fixed[:3, 3])
            rotation = (f"{math.degrees(x):z.6g}°" for x in to_rpy(joint.fixed[:3, :3]))
            rows.append((str(i), *position, *rotation))
    return _table(("joint", "x mm", "y mm", "z mm", "roll", "pitch", "yaw"), rows)


def _names(model: "Arm") -> "Table":
    rows = [(str(i), j.name, k.name) for i, (j, k) in enumerate(zip(model.joints, model.links, strict=True), 1)]
    return _table(("number", "joint", "link"), rows)


def _geometry(model: "Arm") -> "Table":
    rows = []
    for i, joint in enumerate(model.joints, 1):
        theta, d = _angle(joint.theta), _length(joint.d)
        if joint.revolute:
            theta = f"q{i}" if joint.theta == 0 else f"q{i} {math.degrees(joint.theta):+g}°"
        else:
            d = f"q{i}" if joint.d == 0 else f"q{i} {joint.d * 1e3:+g} mm"
        rows.append((str(i), joint.kind, theta, d, _length(joint.a), _angle(joint.alpha)))
    return _table(("joint", "kind", "theta", "d", "a", "alpha"), rows)


def _limits(model: "Arm") -> "Table":
    rows = []
    for i, joint in enumerate(model.joints, 1):
        limits = joint.limits
        unit = "N m" if joint.revolute else "N"
        effort = "-" if math.isinf(limits.effort) else f"{limits.effort:g} {unit}"
        positions = _position(joint, limits.lower), _position(joint, limits.upper)
        rates = _position(joint, limits.speed, "/s"), _position(joint, limits.acceleration, "/s²")
        rows.append((str(i), *positions, *rates, effort))
    return _table(("joint", "from", "to", "speed", "acceleration", "effort"), rows)


def _links(model: "Arm") -> "Table":
    rows = []
    for i, link in enumerate(model.links, 1):
        rows.append((str(i), f"{link.mass:g}", *(f"{x * 1e3:z.6g}" for x in link.com)))
    return _table(("link", "kg", "x mm", "y mm", "z mm"), rows)


def _inertia(model: "Arm") -> "Table":
    entries = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
    rows = []
    for i, link in enumerate(model.links, 1):
        rows.append((str(i), *(f"{link.inertia[entry]:z.4g}" for entry in entries.values())))
    return _table(("link", *entries), rows)


def _motors(model: "Arm") -> "Table":
    rows = []
    for i, (motor, joint) in enumerate(zip(model.motors, model.joints, strict=True), 1):
        inertia, viscous, dry = ("kg m²", "N m s", "N m") if joint.revolute else ("kg", "N s/m", "N")
        forward, backward = motor.coulomb_forward, motor.coulomb_backward
        coulomb = f"{forward:g} {dry}" if forward == backward else f"+{forward:g} / -{backward:g} {dry}"
        friction = f"{motor.viscous:g} {viscous}", coulomb
        rows.append((str(i), f"{motor.inertia:g} {inertia}", *friction, f"{motor.gear_ratio:g}"))
    return _table(("joint", "inertia", "viscous", "Coulomb friction", "gear ratio"), rows)


def _facts(model: "Arm") -> "Table":
    from rich.table import Table

    from armwright.arm.gravity import vector_text
    from armwright.spatial.poses import to_noap

    def noap(X: "Any") -> str:
        numbers = to_noap(X) + 0.0
        columns = ["  ".join(f"{x:z.6g}" for x in numbers[k : k + 3].round(12)) for k in (0, 3, 6)]
        position = "  ".join(f"{x * 1e3:z.6g}" for x in numbers[9:].round(12))
        return f"n ({columns[0]})  o ({columns[1]})  a ({columns[2]})  p ({position}) mm"

    facts = [("base", noap(model.base)), ("tool", noap(model.tool))]
    facts.append(("gravity", f"{vector_text(model.gravity)}, {_GRAVITY_FROM[model.gravity_from]}"))
    if math.isfinite(model.reach):
        facts.append(("reach", _length(model.reach)))
    if math.isfinite(model.tool_speed):
        facts.append(("tool speed", f"{_length(model.tool_speed)}/s at full reach"))
    grid = Table.grid(padding=(0, 2))
    for fact in facts:
        grid.add_row(*fact)
    return grid


def _angle(value: float) -> str:
    return f"{math.degrees(value):g}°"


def _length(value: float) -> str:
    return f"{value * 1e3:zg} mm"


def _position(joint: "Joint", value: float, per: str = "") -> str:
    if math.isinf(value):
        return "-"
    return f"{math.degrees(value):z.4g}°{per}" if joint.revolute else f"{value * 1e3:zg} mm{per}"


def _as_data(model: "Arm") -> "dict[str, Any]":
    import attrs
    import numpy as np

    def plain(_owner: object, _field: object, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.tolist()
        return None if isinstance(value, float) and math.isinf(value) else value

    return attrs.asdict(model, value_serializer=plain)
