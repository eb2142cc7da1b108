"""How the controller of an arm counts its joints, and where its frames stand: data with sources, fitted to an arm."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, read_only
from armwright.errors import UnknownNameError, UnsupportedArmError
from armwright.files.document import Document, Table
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.poses import homogeneous, inverse

_TABLE = Path(__file__).with_name("conventions.toml")
# Directions of axes that are this near are the same, and lines this near [m] have no direction between them.
_SAME_DIRECTION, _SAME_LINE = 1e-6, 1e-6
_JOINTS = 6
# Zero positions are whole quarter turns, but for rounding [rad].
_QUARTER, _ROUNDING = np.pi / 2, 1e-9


@attrs.frozen(kw_only=True)
class SourceNote:
    """Where facts come from: what it says, the document and its revision."""

    says: str
    document: str
    revision: str


@attrs.frozen(kw_only=True, eq=False)
class Convention:
    """An arm in the zero position of its controller, seen from the base frame of that.

    Attributes:
        name: of the convention, such as ``kuka``.
        axes: (6, 3) directions about which the joints turn in the positive sense.
        links: directions from an axis to the next one, by the number of the first, from 0.
        reach: (3,) direction in which the flange is, seen from axis 3.
        flange: (3, 3) orientation of the flange frame.
        base_at_axis_2: whether the base frame stands on axis 1 at the height of axis 2.
        coupled: joint, other joint, from 0, and the factor of the other that is added to what is shown for the first.
        stream_period: of joint positions that are streamed [s]; None where none are.
        arms: names of the arms it holds for.
        ros_joints: what ROS calls the joints.
        sources: of all of that.
    """

    name: str
    axes: Array = attrs.field(converter=read_only)
    links: Mapping[int, Array]
    reach: Array = attrs.field(converter=read_only)
    flange: Array = attrs.field(converter=read_only)
    base_at_axis_2: bool = False
    coupled: tuple[int, int, float] | None = None
    stream_period: float | None = None
    arms: tuple[str, ...] = ()
    ros_joints: tuple[str, ...]
    sources: tuple[SourceNote, ...]


@attrs.frozen(kw_only=True, eq=False)
class ControllerArm:
    """An arm with the convention of its controller.

    Attributes:
        arm: the arm.
        convention: of its controller.
        signs: (n,) 1 where a joint of the controller turns as that of the arm, else -1.
        zeros: (n,) joint positions of the arm where those of the controller are zero [rad].
        X_BC: (4, 4) base frame of the controller, seen from that of the arm.
        X_CT: (4, 4) tool of the arm, seen from the flange frame of the controller.
        front: (3,) where the arm looks, seen from its first link: the x axis of its base where the joints are zero.
    """

    arm: Arm
    convention: Convention
    signs: Array = attrs.field(converter=read_only)
    zeros: Array = attrs.field(converter=read_only)
    X_BC: Array = attrs.field(converter=read_only)
    X_CT: Array = attrs.field(converter=read_only)
    front: Array = attrs.field(converter=read_only)

    def joints(self, q: Array) -> Array:
        """Return joint positions (..., n) [rad] as the controller counts them."""
        shown = self.signs * (q - self.zeros)
        if self.convention.coupled is not None:
            joint, other, factor = self.convention.coupled
            shown[..., joint] += factor * shown[..., other]
        return shown

    def pose(self, X_BT: Array) -> Array:
        """Return poses (..., 4, 4) of the tool, seen from the base frame of the controller."""
        return np.asarray(inverse(self.X_BC) @ X_BT)


@cache
def conventions() -> Mapping[str, Convention]:
    """Return all conventions by name."""
    root = Document.read(_TABLE).root
    return {name: _read(name, root.table(name)) for name in root}


def find_convention(arm: Arm, name: str | None) -> Convention | None:
    """Return the convention of the controller of an arm; None where none is known.

    Args:
        arm: the arm.
        name: of a convention that somebody has chosen; without it, that which lists the name of the arm.

    Raises:
        UnknownNameError: there is no such convention.
    """
    known = conventions()
    if name is not None:
        if name not in known:
            raise UnknownNameError("convention of controllers", name, known)
        return known[name]
    return next((one for one in known.values() if arm.name in one.arms), None)


def controller_arm(arm: Arm, convention: Convention) -> ControllerArm:
    """Return an arm with the convention of its controller.

    Raises:
        UnsupportedArmError: the axes of the arm cannot stand as the convention says.
    """
    fits = [] if arm.n != _JOINTS or not arm.revolute.all() else list(_zero_positions(arm, convention, []))
    if not fits:
        raise UnsupportedArmError(
            f"the axes of '{arm.name}' cannot stand as those of the convention '{convention.name}' in its zero "
            "position: expected six revolute joints with the axes of that convention"
        )
    zeros = min(fits, key=lambda q: (round(float(np.abs(q).sum()), 6), q.tolist()))
    quarters = np.round(zeros / _QUARTER) * _QUARTER
    zeros = np.where(np.abs(zeros - quarters) < _ROUNDING, quarters, zeros)
    frames = link_poses(arm, zeros)
    signs = np.sign(np.einsum("ij,ij->i", frames[:_JOINTS, :3, 2], convention.axes))
    X_BC = np.eye(4)
    if convention.base_at_axis_2:
        X_BC[:3, 3] = frames[0, :3, 3] + frames[0, :3, 2] * (frames[0, :3, 2] @ (frames[1, :3, 3] - frames[0, :3, 3]))
    # The flange frame of the controller stands at the origin of the last frame.
    X_FC = homogeneous(frames[_JOINTS, :3, :3].T @ convention.flange, np.zeros(3))
    return ControllerArm(
        arm=arm,
        convention=convention,
        signs=signs,
        zeros=zeros,
        X_BC=X_BC,
        X_CT=inverse(X_FC) @ arm.tool,
        front=frames[1, 0, :3],
    )


def _zero_positions(arm: Arm, convention: Convention, found: list[float]) -> Iterator[Array]:
    """Give the joint positions in which the axes of an arm stand as a convention says, the first joints being found."""
    number = len(found)
    frames = link_poses(arm, np.array([*found, *[0.0] * (_JOINTS - number)]))
    if number == _JOINTS:
        if _stands(frames, convention):
            yield np.array(found)
        return
    axis = frames[number, :3, 2]
    if np.linalg.norm(np.cross(axis, convention.axes[number])) > _SAME_DIRECTION:
        return
    for wanted, now in _alignments(frames, convention, number):
        angle = float(np.arctan2(axis @ np.cross(now, wanted), now @ wanted))
        yield from _zero_positions(arm, convention, [*found, angle])


def _alignments(frames: Array, convention: Convention, number: int) -> list[tuple[Array, Array]]:
    """Return the directions that a joint is to give to what it moves, each with the direction it has now."""
    if number == _JOINTS - 1:
        return [(convention.flange[:, 0], frames[_JOINTS, :3, 0])]
    following = frames[number + 1, :3, 2]
    if np.linalg.norm(np.cross(frames[number, :3, 2], following)) > _SAME_DIRECTION:
        wanted = convention.axes[number + 1]
        return [(wanted, following), (-wanted, following)]
    if number not in convention.links:
        return []
    return [(convention.links[number], _between(frames, number))]


def _between(frames: Array, number: int) -> Array:
    """Return the vector (3,) from an axis to the next one, at a right angle to the first."""
    apart, axis = frames[number + 1, :3, 3] - frames[number, :3, 3], frames[number, :3, 2]
    return np.asarray(apart - axis * (axis @ apart))


def _stands(frames: Array, convention: Convention) -> bool:
    """Whether axes, links and flange of an arm stand as a convention says."""
    axes = np.abs(np.einsum("ij,ij->i", frames[:_JOINTS, :3, 2], convention.axes))
    links = ((direction, _between(frames, number)) for number, direction in convention.links.items())
    return bool(
        np.all(axes > 1 - _SAME_DIRECTION)
        and all(direction @ apart > -_SAME_LINE for direction, apart in links)
        and convention.reach @ (frames[_JOINTS, :3, 3] - frames[2, :3, 3]) > 0
        and np.abs(np.abs(frames[_JOINTS, :3, 2] @ convention.flange[:, 2]) - 1) < _SAME_DIRECTION
        and _outward(frames) @ convention.flange[:, 2] > 0
    )


def _outward(frames: Array) -> Array:
    """Return the direction (3,) along the last axis in which the flange is, seen from the axis before."""
    axis = frames[_JOINTS - 1, :3, 2]
    return np.asarray(axis * (axis @ (frames[_JOINTS, :3, 3] - frames[_JOINTS - 2, :3, 3])))


def _read(name: str, table: Table) -> Convention:
    x, z = table.vector("flange_x", 3), table.vector("flange_z", 3)
    links, coupled = table.table("links"), table.table("coupled")
    joints = [coupled.whole(key, 1, _JOINTS) - 1 for key in ("joint", "with")] if "coupled" in table else []
    convention = Convention(
        name=name,
        axes=np.array(table.vectors("axes", 3)),
        links={int(number) - 1: links.vector(number, 3) for number in links},
        reach=table.vector("reach", 3),
        flange=np.column_stack([x, np.cross(z, x), z]),
        base_at_axis_2=table.choice("base", ("arm", "axis 2"), default="arm") == "axis 2",
        coupled=(joints[0], joints[1], coupled.number("factor")) if joints else None,
        stream_period=table.number("stream_ms") * 1e-3 if "stream_ms" in table else None,
        arms=tuple(table.texts("arms")),
        ros_joints=tuple(table.texts("ros_joints")),
        sources=tuple(
            SourceNote(says=one.text("says"), document=one.text("document"), revision=one.text("revision"))
            for one in table.tables("sources")
        ),
    )
    table.refuse_unknown_keys()
    return convention
