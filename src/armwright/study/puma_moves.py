"""Joint move and Cartesian move of the PUMA through three poses: the trajectory project, figures 5 to 25.

Half a second from A to B, half a second from B to C, with a blend of 0.2 s on either side of B, at full speed from the
start to the end. The joint move takes the joint angles as the project prints them; the Cartesian move takes place and
ZYZ angles, those of MATLAB's ``rotm2eul``, and never asks what the joints do meanwhile. Here they are asked.
"""

from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.revolutions import mid_range
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.blends import blended, via_deviations
from armwright.motion.chain import chain
from armwright.motion.detour import By
from armwright.motion.hand_path import HandPath, hand_path, zyz_angles
from armwright.motion.limit_utilization import limit_use, slowing_for_limits
from armwright.motion.moves import along, stopping_move
from armwright.motion.obstruction import PathError
from armwright.motion.solver import solver_of
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import xspline
from armwright.spatial.euler import matlab_zyz
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, nearest_rotation

Way: TypeAlias = Literal["joint", "seed", "zyz", "geodesic"]
# What each way is called, in the order of the tables.
WAYS: dict[Way, str] = {
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
PRINTED_PLACES_CM = ((5, -55, -60), (50, -40, 40), (60, 15, -30))
TIMES = (0.0, 0.5, 1.0)  # s
BLEND = 0.2  # s
PERIOD = 0.002  # s
SAMPLES = 501


def study_poses() -> Array:
    """Return the poses A, B, C (3, 4, 4), their printed rotations made exact."""
    return homogeneous(nearest_rotation(PRINTED_ROTATIONS), np.array(PRINTED_PLACES_CM, dtype=np.float64) / 100)


def sample_times() -> Array:
    """Return the 501 moments of the project [s]."""
    return np.linspace(0.0, PERIOD * (SAMPLES - 1), SAMPLES)


def joint_trajectory() -> Trajectory:
    """Return the joint move: the printed angles, straight ways with blends."""
    return blended(TIMES, np.radians(PRINTED_Q), BLEND, ends="running")


def path_of(way: Way) -> HandPath:
    """Return the planned path of the hand of one of the three Cartesian moves."""
    X = study_poses()
    if way == "seed":
        place = blended(TIMES, X[:, :3, 3], BLEND, ends="running")
        angles = blended(TIMES, matlab_zyz(PRINTED_ROTATIONS), BLEND, ends="running")
        return HandPath(place=place, turns=None, angles=angles, times=np.array(TIMES))
    if way == "joint":
        raise UnknownNameError("Cartesian move", way, [known for known in WAYS if known != "joint"])
    return hand_path(X, TIMES, BLEND, ends="running", orientation=way)


def poses_along(way: Way, t: Array) -> Array:
    """Return where the hand is planned to be (k, 4, 4) at times (k,)."""
    if way == "joint":
        return forward(load_arm("puma560-seed"), joint_trajectory()(t))
    return path_of(way)(t)


def joints_along(way: Way) -> Trajectory:
    """Return what the joints do, through the configurations at the 501 moments, whatever their limits."""
    if way == "joint":
        return joint_trajectory()
    t = sample_times()
    X = path_of(way)(t)
    solver = solver_of(_wide(load_arm("puma560-seed")))
    start = inverse(load_arm("puma560-seed"), X[0], np.radians(PRINTED_Q[0])).best.q
    q, _ = chain(solver, X, start)
    # The rates at both ends are those of the parabola through three samples.
    first, last = (sign * (-3 * p[0] + 4 * p[1] - p[2]) / (2 * PERIOD) for sign, p in ((1, q[:3]), (-1, q[:-4:-1])))
    return xspline(t, q, first, last)


def _wide(arm: Arm) -> Arm:
    """Return an arm whose joints may turn as far as they like."""
    free = {"lower": -np.inf, "upper": np.inf}
    joints = [attrs.evolve(joint, limits=attrs.evolve(joint.limits, **free)) for joint in arm.joints]
    return attrs.evolve(arm, joints=joints)


@attrs.frozen(kw_only=True)
class ConfigurationRow:
    """A printed configuration beside the one that its printed pose gives.

    Attributes:
        pose: A, B or C.
        printed: (6) joint positions as printed [deg].
        computed: (6) of the nearest configuration that the pose allows [deg].
        branch: that it belongs to.
        farthest: largest difference [deg].
        allowed: all branches inside the limits there.
    """

    pose: str
    printed: tuple[float, ...]
    computed: tuple[float, ...]
    branch: str
    farthest: float
    allowed: tuple[str, ...]


def configuration_table() -> list[ConfigurationRow]:
    """Return printed and computed configurations: two printed digits of a rotation are a degree near the wrist."""
    arm, rows = load_arm("puma560-seed"), []
    for name, printed, X in zip(NAMES, PRINTED_Q, study_poses(), strict=True):
        found = inverse(arm, X, np.radians(printed))
        computed = np.degrees(found.best.q)
        rows.append(
            ConfigurationRow(
                pose=name,
                printed=printed,
                computed=tuple(computed.tolist()),
                branch=found.best.label,
                farthest=float(np.abs(computed - printed).max()),
                allowed=tuple(branch.label for branch in found.allowed),
            )
        )
    return rows


@attrs.frozen(kw_only=True)
class AngleRow:
    """ZYZ angles of a pose.

    Attributes:
        pose: A, B or C.
        matlab: (3) phi, theta, psi as MATLAB has them of the printed rotation [deg].
        nearest: (3) those next to the ones of the other poses, of the exact rotation [deg].
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
    """The largest part of a limit that is used, and the joint, from 1."""

    part: float
    joint: int


@attrs.frozen(kw_only=True)
class MoveRow:
    """One way to run through the three poses in a second.

    Attributes:
        way: what it is.
        inverse: number of configurations that are solved for.
        length: way of the hand [m].
        off: farthest that the hand is from the straight ways A B C [m].
        turn: by how much the hand turns altogether [rad].
        joints: by how much all six joints turn altogether [rad].
        speed: largest part of a speed limit.
        acceleration: largest part of an acceleration limit.
        effort: largest part of an effort limit.
        slower: how many times slower it must run to keep all of these.
        stopped: what keeps it from being run with the joints' limits; empty where nothing does.
    """

    way: str
    inverse: int
    length: float
    off: float
    turn: float
    joints: float
    speed: Largest
    acceleration: Largest
    effort: Largest
    slower: float
    stopped: str


def move_table() -> list[MoveRow]:
    """Return the two kinds of move as measured numbers, the Cartesian one in three ways to turn."""
    arm, t = load_arm("puma560-seed"), sample_times()
    rows = []
    for way, name in WAYS.items():
        X, joints = poses_along(way, t), joints_along(way)
        uses = {
            limit: Largest(float(use.max()), int(use.argmax()) + 1) for limit, use in limit_use(arm, joints).items()
        }
        rows.append(
            MoveRow(
                way=name,
                inverse=len(NAMES) if way == "joint" else SAMPLES,
                length=float(np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=-1).sum()),
                off=_off(X[:, :3, 3]),
                turn=float(angle_between(X[:-1, :3, :3], X[1:, :3, :3]).sum()),
                joints=float(np.abs(np.diff(joints(t), axis=0)).sum()),
                speed=uses["speed"],
                acceleration=uses["acceleration"],
                effort=uses["effort"],
                slower=slowing_for_limits(arm, joints)[0],
                stopped=_stopped(arm, way),
            )
        )
    return rows


def _off(p: Array) -> float:
    """Return the largest distance of places (k, 3) from the straight ways A B C."""
    stops = study_poses()[:, :3, 3]
    ways = np.diff(stops, axis=0)
    parts = np.clip(((p[:, None] - stops[:-1]) * ways).sum(-1) / (ways * ways).sum(-1), 0, 1)
    nearest = stops[:-1] + parts[..., None] * ways
    return float(np.linalg.norm(p[:, None] - nearest, axis=-1).min(axis=1).max())


def _stopped(arm: Arm, way: Way) -> str:
    if way == "joint":
        return ""
    try:
        along(arm, study_poses(), path_of(way), np.array(TIMES), BLEND, near=mid_range(arm), ends="running")
    except PathError as error:
        return str(error)
    return ""


@attrs.frozen(kw_only=True)
class WayRoundRow:
    """A way round what stops the Cartesian move from B to C.

    Attributes:
        by: via poses or damped rates.
        found: whether there is one.
        said: its price; or what stopped the line, where there is none.
    """

    by: By
    found: bool
    said: str


def way_round_table() -> list[WayRoundRow]:
    """Return what becomes of straight lines A B C with stops, where ways round are looked for."""
    rows: list[WayRoundRow] = []
    ways: tuple[By, ...] = ("via", "damped")
    for by in ways:
        try:
            move = stopping_move(load_arm("puma560-seed"), study_poses(), by=by)
        except PathError as error:
            rows.append(WayRoundRow(by=by, found=False, said=str(error)))
        else:
            rows.append(WayRoundRow(by=by, found=True, said=f"{move.times[-1]:.1f} s; {move.detours[-1].price}"))
    return rows


def missed_at_b() -> Array:
    """Return by how much the joint move misses the configuration B when it is passed (6,) [rad], by the formula."""
    return np.asarray(via_deviations(TIMES, np.radians(PRINTED_Q), BLEND, ends="running")[1])


@attrs.frozen(kw_only=True, eq=False)
class Course:
    """Curves of one of the project's figures.

    Attributes:
        title: what they show.
        unit: of the curves.
        curves: (501,) numbers by the name of the curve.
    """

    title: str
    unit: str
    curves: dict[str, Array]


# Figures of the project: curves over time, the path in space, all together, and the film.
CURVES: dict[int, tuple[Way, int]] = {
    5: ("joint", 0),
    6: ("joint", 1),
    7: ("joint", 2),
    16: ("seed", 0),
    17: ("seed", 1),
    18: ("seed", 2),
}
PATHS: dict[int, Way] = {10: "joint", 19: "seed"}
OVERVIEWS: dict[int, Way] = {22: "joint", 23: "seed"}
FILM = 25


def courses(number: int) -> list[Course]:
    """Return the curves of a figure over ``sample_times``: joints, or place and ZYZ angles of the hand.

    Args:
        number: 5 to 7 for angle, speed, acceleration of the joint move; 16 to 18 for those of the Cartesian move.

    Raises:
        UnknownNameError: there is no such figure with curves.
    """
    if number not in CURVES:
        raise UnknownNameError("figure", str(number), [str(known) for known in CURVES])
    way, order = CURVES[number]
    per = ("", "/s", "/s²")[order]
    t = sample_times()
    if way == "joint":
        q = np.degrees(joint_trajectory()(t, order))
        title = ("joint angles", "joint speeds", "joint accelerations")[order]
        return [Course(title=title, unit=f"deg{per}", curves={f"joint {i + 1}": q[:, i] for i in range(6)})]
    hand = path_of(way)
    assert hand.angles is not None  # noqa: S101 - the project's way has them
    place, angles = hand.place(t, order) * 100, np.degrees(hand.angles(t, order))
    what = ("", "speed of the ", "acceleration of the ")[order]
    return [
        Course(title=f"{what}place", unit=f"cm{per}", curves=dict(zip("xyz", place.T, strict=True))),
        Course(
            title=f"{what}ZYZ angles",
            unit=f"deg{per}",
            curves=dict(zip(("phi", "theta", "psi"), angles.T, strict=True)),
        ),
    ]
