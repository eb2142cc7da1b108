"""Arms from files: the catalogue by name, any other by path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.collision_pairs import collision_pairs_in
from armwright.arm.coupling import Coupling
from armwright.arm.dh import about_com, from_modified
from armwright.arm.documents import SourceDocument, documents_in
from armwright.arm.drive import STIFFNESS, Motor, Spring
from armwright.arm.limits import Limits
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Joint, Link
from armwright.arm.quantities import ANGLE, LENGTH, number_in, per, pose_in, typed_pose, unit_of, vector_in
from armwright.arm.solid_entries import solids_in
from armwright.arm.tensors import impossible_moments, moments_message
from armwright.arm.tree.axes import dh_form
from armwright.arm.uncertainty import Uncertainty
from armwright.arrays import Array
from armwright.errors import InvalidValueError, KindError, ShapeError, UnknownNameError, shown
from armwright.files.document import Document, Table
from armwright.files.inputs import file_path, read_text
from armwright.files.limits import limit, limit_message

_CATALOGUE = Path(__file__).parent / "catalogue"


@attrs.frozen(kw_only=True)
class ArmSummary:
    """What the catalogue says of an arm before it is read.

    Attributes:
        name: in the catalogue.
        joints: how many it has.
        title: one line on what it is.
        source: where the numbers come from.
        documents: the documents that they were read in.
    """

    name: str
    joints: int
    title: str
    source: str
    documents: tuple[SourceDocument, ...]


# Files of the robot description format; one of xacro is told apart there, with what to do.
_URDF = (".urdf", ".xacro")
_MJCF = ".xml"


def arm_names() -> tuple[str, ...]:
    """Return the names of the catalogue, sorted."""
    return tuple(sorted(path.stem for path in _CATALOGUE.glob("*.toml")))


def arm_summaries() -> tuple[ArmSummary, ...]:
    """Return what the files of the catalogue say at their beginnings, in the order of the names."""
    return tuple(_summary(_CATALOGUE / f"{name}.toml") for name in arm_names())


def _summary(path: Path) -> ArmSummary:
    """Read the keys at the top of a file of the catalogue, which is much quicker than the joints below them."""
    text = read_text(path)
    top = Document.parse(path, text.partition("\n[[joint]]")[0], is_json=False).root
    return ArmSummary(
        name=path.stem,
        joints=sum(line.startswith("[[joint]]") for line in text.splitlines()),
        title=top.text("title"),
        source=top.text("source"),
        documents=documents_in(top),
    )


def load_arm(name: str | Path, *, packages: Mapping[str, Path | str] | None = None) -> Arm:
    """Return an arm by its name in the catalogue, or from a file.

    Args:
        name: such as ``puma560``; something with a slash or ending in .toml, .json, .urdf or .xml (MJCF) is a path.
        packages: folders of packages, by name, in which the meshes of a URDF file are.

    Raises:
        MissingExtraError: the file is URDF, and lxml is not installed, or MJCF, and MuJoCo cannot be loaded.
        KindError: the name is neither a text nor a path.
        UnknownNameError: the catalogue has no such arm; the nearest is named.
        FileFormatError: the file is missing, broken, or says what cannot be; the text has file, line and key.
    """
    if not isinstance(name, str | Path):
        raise KindError(f"name: expected the name of an arm or the path of a file, got {shown(name)}")
    if is_path(name):
        suffix = Path(name).suffix.lower()
        if suffix in _URDF:
            from armwright.arm.urdf.reader import load_urdf  # noqa: PLC0415 - few arms are in such files

            return load_urdf(name, packages=packages)
        if suffix == _MJCF:
            from armwright.arm.mjcf.reader import load_mjcf  # noqa: PLC0415 - few arms are in such files

            return load_mjcf(name)
        return read_arm(name)
    if name not in arm_names():
        raise UnknownNameError("arm", name, arm_names(), similar=_similar(str(name)), all_by="armwright arms")
    return read_arm(_CATALOGUE / f"{name}.toml")


def _similar(name: str) -> list[str]:
    """Return the arms that have a word in their names or titles, else those whose names begin as it does."""
    word, all_of = name.lower(), arm_summaries()
    found = [each.name for each in all_of if word and (word in each.name or word in each.title.lower())]
    return found or [each.name for each in all_of if word and each.name[:3] == word[:3]]


def is_path(name: str | Path) -> bool:
    """Whether a name means a file and not an arm of the catalogue."""
    return isinstance(name, Path) or "/" in name or name.lower().endswith((".toml", ".json", _MJCF, *_URDF))


def read_arm(path: Path | str) -> Arm:
    """Read an arm file.

    Args:
        path: the file; its format is in docs/arms.md.

    Raises:
        FileFormatError: the file is missing, broken, or says what cannot be; the text has file, line and key.
    """
    return _arm(Document.read(path))


def parse_arm(text: str, path: Path | str) -> Arm:
    """Return the arm of the text of an arm file that stands in another file.

    Args:
        text: in TOML; its format is in docs/arms.md.
        path: of that other file, for messages.

    Raises:
        FileFormatError: the text is broken, or says what cannot be.
    """
    return _arm(Document.parse(file_path(path), text, is_json=False))


def _arm(document: Document) -> Arm:
    top = document.root
    convention = top.choice("convention", ("standard", "modified", "urdf"), default="standard")
    tables = top.tables("joint", "joints")
    coupled, coupling = "coupling" in top, top.table("coupling")
    rows = coupling.vectors("matrix", len(tables)) if coupled else []
    coupling.refuse_unknown_keys()
    joints, links, motors, drive_limits, origins, axes = [], [], [], [], [], []
    for table in tables:
        if convention == "urdf":
            origins.append(typed_pose(table).X)
            axes.append(_axis(table))
        joints.append(_joint(table, dh=convention != "urdf"))
        links.append(_link(table.table("link")))
        motor = table.table("motor")
        drive_limits.append(_drive_limits(motor, joints[-1].kind, coupled=coupled))
        motors.append(_motor(motor, joints[-1].revolute))
        table.refuse_unknown_keys()
    base, tool = pose_in(top.table("base")), pose_in(top.table("tool"))
    if convention == "modified":
        before, joints, links = from_modified(joints, links)
        base = base @ before
    elif convention == "urdf":
        before, joints, links, tool = dh_form(origins, axes, joints, links, tool)
        base = base @ before
    hand = top.table("hand")
    gravity = top.table("gravity")
    stated = "m_per_s2" in gravity
    arm = Arm(
        name=top.text("name", default=document.path.stem),
        title=top.text("title", default=""),
        joints=joints,
        links=links,
        motors=motors,
        coupling=_coupling(coupling, rows, drive_limits) if coupled else None,
        base=base,
        tool=tool,
        gravity=gravity.vector("m_per_s2", 3, default=UPRIGHT_GRAVITY),
        gravity_from="stated" if stated else "standard",
        reach=number_in(hand, "reach", LENGTH, default=math.inf, positive=True),
        tool_speed=number_in(hand, "speed", {"m_per_s": 1.0, "mm_per_s": 1e-3}, default=math.inf, positive=True),
        base_solids=solids_in(top, "base_solids"),
        collisions=collision_pairs_in(top.table("collisions"), [link.name for link in links]),
        base_link=top.text("base_link", default=""),
        tool_link=top.text("tool_link", default=""),
        source=top.text("source", default=""),
        uncertainty=_uncertainty(top.table("uncertainty")),
        documents=documents_in(top),
    )
    for table in (hand, gravity, top):
        table.refuse_unknown_keys()
    return arm


def read_load(path: Path | str) -> Link:
    """Read the file of a load in the hand: the keys of a link, in the tool frame.

    Args:
        path: the file; its format is in docs/arms.md.

    Raises:
        FileFormatError: the file is missing, broken, or says what cannot be; the text has file, line and key.
    """
    top = Document.read(path).root
    top.number("mass_kg")  # a link may go without, a load not
    return _link(top)


def _uncertainty(table: Table) -> Uncertainty | None:
    if not list(table):
        return None
    errors = table.texts("errors")
    rows = table.vectors("covariance", len(errors))
    noise = number_in(table, "noise", LENGTH, default=0.0)
    table.refuse_unknown_keys()
    try:
        return Uncertainty(errors=errors, covariance=np.array(rows), noise=noise)
    except (InvalidValueError, ShapeError) as error:
        raise table.error(None, str(error)) from error


def _axis(table: Table) -> Array:
    """Read the axis of a joint in its frame, as a unit vector."""
    axis = table.vector("axis", 3)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise table.error("axis", "expected a direction, got a vector of length 0")
    return axis / length


def _joint(table: Table, *, dh: bool) -> Joint:
    """Read a joint; the four parameters of its row only where the convention has them."""
    kind = table.choice("kind", ("revolute", "prismatic"))
    units = ANGLE if kind == "revolute" else LENGTH
    spring = table.table("spring")
    joint = Joint(
        kind="revolute" if kind == "revolute" else "prismatic",
        limits=_limits(table.table("limits"), kind),
        spring=_spring(spring, units),
        name=table.text("name", default=""),
    )
    if not dh:
        return joint
    table.allow("fixed")
    return attrs.evolve(
        joint,
        theta=number_in(table, "theta", ANGLE, default=0.0),
        d=number_in(table, "d", LENGTH, default=0.0),
        a=number_in(table, "a", LENGTH, default=0.0),
        alpha=number_in(table, "alpha", ANGLE, default=0.0),
        fixed=pose_in(table.table("fixed")) if "fixed" in table else None,
    )


def _limits(limits: Table, kind: str) -> Limits:
    """Read what a joint, or its drive, may do."""
    units, effort = (ANGLE, {"Nm": 1.0}) if kind == "revolute" else (LENGTH, {"N": 1.0})
    values = {
        "lower": number_in(limits, "lower", units, default=-math.inf),
        "upper": number_in(limits, "upper", units, default=math.inf),
        "speed": number_in(limits, "speed", per(units, "per_s"), default=math.inf, positive=True),
        "acceleration": number_in(limits, "acceleration", per(units, "per_s2"), default=math.inf, positive=True),
        "effort": number_in(limits, "effort", effort, default=math.inf, positive=True),
    }
    limits.refuse_unknown_keys()
    if not values["lower"] < values["upper"]:
        lower, upper = (_written(kind, values[name]) for name in ("lower", "upper"))
        raise limits.error(None, f"the lower limit must be below the upper, got {lower} and {upper}")
    most = limit("revolutions") * math.tau
    for name in ("lower", "upper"):
        if kind == "revolute" and most < abs(values[name]) < math.inf:
            raise limits.error(
                unit_of(limits, name, units) and f"{name}_{unit_of(limits, name, units)}",
                f"too far from zero: {limit_message('revolutions', _written(kind, values[name]))}; for a joint without "
                "limits omit it",
            )
    return Limits(**values)


def _drive_limits(motor: Table, kind: str, *, coupled: bool) -> Limits | None:
    """Read what a drive may do; None where nothing is said."""
    if "limits" not in motor:
        return None
    if not coupled:
        message = "the drive moves its joint alone; specify [joint.limits], or how the drives are coupled: [coupling]"
        raise motor.error("limits", message)
    return _limits(motor.table("limits"), kind)


def _coupling(table: Table, rows: Sequence[Array], drive_limits: Sequence[Limits | None]) -> Coupling:
    """Return how the drives move the joints, by the rows of the matrix; limits are None where the file has none."""
    if len(rows) != len(drive_limits):
        raise table.error("matrix", f"expected {len(drive_limits)} rows, one for each joint, got {len(rows)}")
    try:
        return Coupling(matrix=np.array(rows), limits=[each or Limits() for each in drive_limits])
    except (InvalidValueError, ShapeError) as error:
        raise table.error("matrix", str(error).removeprefix("coupling: ")) from error


def _link(table: Table) -> Link:
    name, unknown = table.text("name", default=""), table.text("unknown", default="")
    if unknown:
        for key in ("mass_kg", "com_m", "inertia_kgm2"):
            if key in table:
                raise table.error(key, "mass and inertia are declared unknown; specify either them or the reason")
        solids = solids_in(table, "solids")
        table.refuse_unknown_keys()
        return Link(unknown=unknown, name=name, solids=solids)
    mass = table.number("mass_kg", default=0.0, lower=0.0)
    com = vector_in(table, "com", LENGTH, default=np.zeros(3))
    numbers = table.vector("inertia_kgm2", (3, 6), default=np.zeros(3))
    about = table.choice("inertia_about", ("com", "frame"), default="com")
    solids = solids_in(table, "solids")
    table.refuse_unknown_keys()
    xx, yy, zz, xy, xz, yz = (*numbers, 0.0, 0.0, 0.0)[:6]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if about == "frame":
        inertia = about_com(inertia, mass, com)
    moments = impossible_moments(mass, com, inertia)
    if moments is not None:
        raise table.error("inertia_kgm2", f"{moments_message(moments)}; check inertia_about and com")
    return Link(mass=mass, com=com, inertia=inertia, name=name, solids=solids)


def _spring(table: Table, units: dict[str, float]) -> Spring:
    key = "stiffness_Nm_per_rad" if units is ANGLE else "stiffness_N_per_m"
    spring = Spring(
        stiffness=table.number(key, default=0.0, lower=0.0), rest=number_in(table, "rest", units, default=0.0)
    )
    table.refuse_unknown_keys()
    return spring


def _motor(table: Table, revolute: bool) -> Motor:  # noqa: FBT001
    ratio = table.positive("gear_ratio", default=1.0)
    inertia = table.number("inertia_kgm2" if revolute else "inertia_kg", default=0.0, lower=0.0)
    if "rotor_inertia_kgm2" in table:
        if inertia:
            message = "specify the inertia at the load side or that of the rotor, not both"
            raise table.error("rotor_inertia_kgm2", message)
        inertia = table.number("rotor_inertia_kgm2", lower=0.0) * ratio**2
    force = "Nm" if revolute else "N"
    speed = per(ANGLE if revolute else LENGTH, "per_s")
    stribeck = table.number(f"stribeck_{force}", default=0.0, lower=0.0)
    stribeck_speed = number_in(table, "stribeck_speed", speed, default=0.0, positive=True)
    if stribeck and not stribeck_speed:
        keys = " or ".join(f"stribeck_speed_{unit}" for unit in speed)
        raise table.error(f"stribeck_{force}", f"how it fades is missing: specify {keys}, at which 1/e of it is left")
    motor = Motor(
        inertia=inertia,
        gear_ratio=ratio,
        viscous=table.number("viscous_Nms" if revolute else "viscous_Ns_per_m", default=0.0, lower=0.0),
        coulomb_forward=table.number(f"coulomb_forward_{force}", default=0.0, lower=0.0),
        coulomb_backward=table.number(f"coulomb_backward_{force}", default=0.0, lower=0.0),
        offset=table.number(f"offset_{force}", default=0.0),
        stribeck=stribeck,
        stribeck_speed=stribeck_speed,
        cube_root=table.number(f"cube_root_{force}", default=0.0, lower=0.0),
        stiffness=table.number(
            "stiffness_Nm_per_rad" if revolute else "stiffness_N_per_m",
            default=math.inf,
            lower=STIFFNESS[0],
            upper=STIFFNESS[1],
        ),
        damping=table.number("damping_Nms" if revolute else "damping_Ns_per_m", default=0.0, lower=0.0),
    )
    table.refuse_unknown_keys()
    return motor


def _written(kind: str, position: float) -> str:
    """Write a position as arm files do."""
    return f"{math.degrees(position):g}°" if kind == "revolute" else f"{position * 1e3:g} mm"
