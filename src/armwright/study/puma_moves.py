"""Joint move and Cartesian move of the PUMA through three poses: the trajectory project, figures 5 to 25.

Half a second from A to B, half a second from B to C, with a blend of 0.2 s on either side of B, at full speed from the
start to the end. The joint move uses the joint angles as the project prints them; the Cartesian move uses positions and
ZYZ angles, those of MATLAB's ``rotm2eul``, and does not consider the motion of the joints. Here it is computed.
"""

from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import UnknownNameError, one_of
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.revolutions import mid_range
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.blends import blended
from armwright.motion.chain import chain
from armwright.motion.detour import DetourMethod
from armwright.motion.limit_utilization import limit_use, slowing_for_limits
from armwright.motion.moves import along, stopping_move
from armwright.motion.obstruction import PathError
from armwright.motion.solver import solver_of
from armwright.motion.tool_path import ToolPath, ZYZAngles, tool_path, zyz_angles
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import xspline
from armwright.report.move_figures import Panel
from armwright.spatial.euler import matlab_zyz
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, nearest_rotation

MoveKind: TypeAlias = Literal["joint", "seed", "zyz", "geodesic"]
# The kinds of move with their names, in the order of the tables.
MOVES: dict[MoveKind, str] = {
    "joint": "joint move",
    "seed": "Cartesian, MATLAB's ZYZ angles",
    "zyz": "Cartesian, nearest ZYZ angles",
    "geodesic": "Cartesian, about one axis",
}
NAMES = ("A", "B", "C")
# Joint positions as the project prints them [deg], and its poses.
PRINTED_Q = (
    (-100.4577, 70.6108, 48.3997, 0.0, 60.9896, 29.2746),
    (-52.1158, -1.4358, 30.2060, 58.6166, 11.4781, 3.2859),
    (0.0955, 65.7969, 14.3196, 15.3377, -20.1730, 29.5160),
)
PRINTED_ROTATIONS = (
    ((0.64, 0.77, 0), (0.77, -0.64, 0), (0, 0, -1)),
    ((0.87, -0.1, 0.48), (0.29, 0.9, -0.34), (-0.4, 0.43, 0.81)),
    ((0.41, -0.29, 0.87), (0.69, 0.71, -0.09), (-0.6, 0.64, 0.49)),
)
PRINTED_POSITIONS_CM = ((5, -55, -60), (50, -40, 40), (60, 15, -30))
TIMES = (0.0, 0.5, 1.0)  # s
BLEND = 0.2  # s
PERIOD = 0.002  # s
SAMPLES = 501


def study_poses() -> Array:
    """Return the poses A, B, C (3, 4, 4), with the nearest rotations to the printed ones."""
    return homogeneous(nearest_rotation(PRINTED_ROTATIONS), np.array(PRINTED_POSITIONS_CM, dtype=np.float64) / 100)


def sample_times() -> Array:
    """Return the 501 sample times of the project [s]."""
    return np.linspace(0.0, PERIOD * (SAMPLES - 1), SAMPLES)


def joint_trajectory() -> Trajectory:
    """Return the joint move: straight segments between the printed angles, with blends."""
    return blended(TIMES, np.radians(PRINTED_Q), BLEND, ends="running")


def path_of(kind: MoveKind) -> ToolPath:
    """Return the planned path of the tool of a Cartesian move."""
    X = study_poses()
    if kind == "seed":
        position = blended(TIMES, X[:, :3, 3], BLEND, ends="running")
        angles = blended(TIMES, matlab_zyz(PRINTED_ROTATIONS), BLEND, ends="running")
        return ToolPath(position=position, orientation=ZYZAngles(angles), times=np.array(TIMES))
    if kind == "joint":
        raise UnknownNameError("Cartesian move", kind, [known for known in MOVES if known != "joint"])
    return tool_path(X, TIMES, BLEND, ends="running", orientation=kind)


def poses_along(kind: MoveKind, t: Array) -> Array:
    """Return the planned poses of the tool (k, 4, 4) at times (k,)."""
    if kind == "joint":
        return forward(load_arm("puma560-seed"), joint_trajectory()(t))
    return path_of(kind)(t)


def joints_along(kind: MoveKind) -> Trajectory:
    """Return the trajectory of the joints through the configurations at the sample times, without regard to limits."""
    if kind == "joint":
        return joint_trajectory()
    t = sample_times()
    X = path_of(kind)(t)
    arm = load_arm("puma560-seed")
    free = {"lower": -np.inf, "upper": np.inf}
    joints = [attrs.evolve(joint, limits=attrs.evolve(joint.limits, **free)) for joint in arm.joints]
    start = inverse(arm, X[0], np.radians(PRINTED_Q[0])).best.q
    q, _ = chain(solver_of(attrs.evolve(arm, joints=joints)), X, start)
    # The velocities at both ends are those of the parabola through three samples.
    first, last = (sign * (-3 * p[0] + 4 * p[1] - p[2]) / (2 * PERIOD) for sign, p in ((1, q[:3]), (-1, q[:-4:-1])))
    return xspline(t, q, first, last)


@attrs.frozen(kw_only=True)
class ConfigurationRow:
    """A printed configuration beside the one computed from its printed pose.

    Attributes:
        pose: A, B or C.
        printed: (6) joint positions as printed [deg].
        computed: (6) joint positions of the nearest solution [deg].
        branch: branch of that solution.
        farthest: largest difference [deg].
        allowed: all branches within the limits.
    """

    pose: str
    printed: tuple[float, ...]
    computed: tuple[float, ...]
    branch: str
    farthest: float
    allowed: tuple[str, ...]


def configuration_table() -> list[ConfigurationRow]:
    """Return printed and computed configurations; rotations with two digits make a difference of a degree."""
    arm, rows = load_arm("puma560-seed"), []
    for name, printed, X in zip(NAMES, PRINTED_Q, study_poses(), strict=True):
        solution = inverse(arm, X, np.radians(printed))
        q, allowed = np.degrees(solution.best.q), tuple(branch.label for branch in solution.allowed)
        branch, farthest = solution.best.label, float(np.abs(q - printed).max())
        computed = tuple(q.tolist())
        rows.append(
            ConfigurationRow(
                pose=name, printed=printed, computed=computed, branch=branch, farthest=farthest, allowed=allowed
            )
        )
    return rows


@attrs.frozen(kw_only=True)
class AngleRow:
    """ZYZ angles of a pose.

    Attributes:
        pose: A, B or C.
        matlab: (3) phi, theta, psi by MATLAB of the printed rotation [deg].
        nearest: (3) those nearest to the angles of the other poses, of the exact rotation [deg].
    """

    pose: str
    matlab: tuple[float, ...]
    nearest: tuple[float, ...]


def angle_table() -> list[AngleRow]:
    """Return the ZYZ angles that the Cartesian moves blend."""
    nearest = np.degrees(zyz_angles(study_poses()[:, :3, :3]))
    matlab = np.degrees(matlab_zyz(PRINTED_ROTATIONS))
    return [
        AngleRow(pose=name, matlab=tuple(m), nearest=tuple(n))
        for name, m, n in zip(NAMES, matlab.tolist(), nearest.tolist(), strict=True)
    ]


class Largest(NamedTuple):
    """The largest utilization of a limit, and its joint, from 1."""

    part: float
    joint: int


@attrs.frozen(kw_only=True)
class MoveRow:
    """A move through the three poses in a second.

    Attributes:
        name: name of the move.
        inverse: number of configurations that are solved for.
        length: length of the path of the tool [m].
        deviation: largest distance of the tool from the line segments A B C [m].
        rotation: total rotation of the tool [rad].
        joints: total rotation of all six joints [rad].
        speed: largest utilization of a speed limit.
        acceleration: largest utilization of an acceleration limit.
        effort: largest utilization of an effort limit.
        slower: factor by which it must be slowed down to satisfy these limits.
        stopped: the obstacle if the position limits are respected; empty without an obstacle.
    """

    name: str
    inverse: int
    length: float
    deviation: float
    rotation: float
    joints: float
    speed: Largest
    acceleration: Largest
    effort: Largest
    slower: float
    stopped: str


def move_table() -> list[MoveRow]:
    """Return the joint move and the Cartesian moves with three interpolations of orientation, as numbers."""
    arm, t = load_arm("puma560-seed"), sample_times()
    rows = []
    for kind, name in MOVES.items():
        X, joints = poses_along(kind, t), joints_along(kind)
        uses = limit_use(arm, joints).items()
        rows.append(
            MoveRow(
                name=name,
                inverse=len(NAMES) if kind == "joint" else SAMPLES,
                length=float(np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=-1).sum()),
                deviation=_deviation(X[:, :3, 3]),
                rotation=float(angle_between(X[:-1, :3, :3], X[1:, :3, :3]).sum()),
                joints=float(np.abs(np.diff(joints(t), axis=0)).sum()),
                **{limit: Largest(float(use.max()), int(use.argmax()) + 1) for limit, use in uses},
                slower=slowing_for_limits(arm, joints)[0],
                stopped=_stopped(arm, kind),
            )
        )
    return rows


def _deviation(p: Array) -> float:
    """Return the largest distance of positions (k, 3) from the line segments A B C."""
    stops = study_poses()[:, :3, 3]
    segments = np.diff(stops, axis=0)
    parts = np.clip(((p[:, None] - stops[:-1]) * segments).sum(-1) / (segments * segments).sum(-1), 0, 1)
    nearest = stops[:-1] + parts[..., None] * segments
    return float(np.linalg.norm(p[:, None] - nearest, axis=-1).min(axis=1).max())


def _stopped(arm: Arm, kind: MoveKind) -> str:
    if kind == "joint":
        return ""
    try:
        along(arm, study_poses(), path_of(kind), np.array(TIMES), BLEND, near=mid_range(arm), ends="running")
    except PathError as error:
        return str(error)
    return ""


@attrs.frozen(kw_only=True)
class DetourRow:
    """A detour of straight lines A B C.

    Attributes:
        method: by a via pose or damped least squares.
        exists: whether there is such a detour.
        summary: its cost, or the obstacle without a detour.
    """

    method: DetourMethod
    exists: bool
    summary: str


def detour_table() -> list[DetourRow]:
    """Return the results of both searches for detours of straight lines A B C with stops."""
    rows: list[DetourRow] = []
    methods: tuple[DetourMethod, ...] = ("via", "damped")
    for method in methods:
        try:
            move = stopping_move(load_arm("puma560-seed"), study_poses(), method=method)
        except PathError as error:
            rows.append(DetourRow(method=method, exists=False, summary=str(error)))
        else:
            summary = f"{move.times[-1]:.1f} s; {move.detours[-1].price}"
            rows.append(DetourRow(method=method, exists=True, summary=summary))
    return rows


# Figures of the project: curves over time, the path in space, overviews, and the film.
CURVES: dict[int, tuple[MoveKind, int]] = {
    5: ("joint", 0), 6: ("joint", 1), 7: ("joint", 2), 16: ("seed", 0), 17: ("seed", 1), 18: ("seed", 2),
}  # fmt: skip
PATHS: dict[int, MoveKind] = {10: "joint", 19: "seed"}
OVERVIEWS: dict[int, MoveKind] = {22: "joint", 23: "seed"}
FILM = 25


def figure_panels(number: int) -> list[Panel]:
    """Return the curves of a figure over ``sample_times``: joints, or position and ZYZ angles of the tool.

    Args:
        number: 5 to 7 for angle, speed, acceleration of the joint move; 16 to 18 for those of the Cartesian move.

    Raises:
        UnknownNameError: the figure does not exist, or has no curves.
    """
    one_of("figure", str(number), map(str, CURVES))
    kind, order = CURVES[number]
    per = ("", "/s", "/s²")[order]
    t = sample_times()
    if kind == "joint":
        q = np.degrees(joint_trajectory()(t, order))
        title = ("joint angles", "joint speeds", "joint accelerations")[order]
        return [Panel(title, f"deg{per}", {f"joint {i + 1}": q[:, i] for i in range(6)})]
    hand = path_of(kind)
    assert isinstance(hand.orientation, ZYZAngles)  # noqa: S101 - this path has them
    position, angles = hand.position(t, order) * 100, np.degrees(hand.orientation.angles(t, order))
    derivative = ("", "speed of the ", "acceleration of the ")[order]
    return [
        Panel(f"{derivative}position", f"cm{per}", dict(zip("xyz", position.T, strict=True))),
        Panel(f"{derivative}ZYZ angles", f"deg{per}", dict(zip(("phi", "theta", "psi"), angles.T, strict=True))),
    ]
