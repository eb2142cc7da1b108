"""Where inverse kinematics goes wrong: sets of poses at the edges, each with what is known of them by construction."""

import attrs
import numpy as np
from scipy.optimize import brentq

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry
from armwright.kinematics.inverse_kinematics.recognise import closed_form_geometry
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.singularity_analysis import determinant_factors
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector

ARMS = ("puma560", "stanford", "ur5")
# Smallest singular value of the Jacobian of a well-conditioned configuration [m].
REGULAR = 1e-3
DECADES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 0.0)
# A pose is met within this [m] and [rad].
MET = 1e-6
_GRID, _MANY, _FEW = 2000, 240, 10
# The other two factors of the determinant are at least this far from 0 where one of them vanishes.
_APART = 0.1
_MARGIN = 0.05


@attrs.frozen(kw_only=True, eq=False)
class EdgeSet:
    """Poses of one kind for one arm.

    Attributes:
        name: what the poses are.
        arm: the arm, with the limits that count.
        X: (N, 4, 4) the poses.
        q: (N, 6) the configurations that they were made of.
        met: how near to the pose counts as met [m] and [rad].
        reachable: whether the arm can be at the poses, limits aside.
        own: whether the configuration that made a pose should be among the answers.
        turns: whether it should be so with its whole turns, when asked from there.
        decade: distance from the singularity; None for other sets.
    """

    name: str
    arm: Arm
    X: Array
    q: Array
    met: float = MET
    reachable: bool = True
    own: bool = True
    turns: bool = False
    decade: float | None = None


def edge_sets(name: str) -> list[EdgeSet]:
    """Return all sets for one arm of the catalogue."""
    rng = np.random.default_rng(83008)
    arm = load_arm(name)
    return [
        *_grid(arm),
        _right_angle(arm, rng),
        *_singular(_wide(arm), rng),
        _at_limits(arm, rng),
        *_rounded(arm, rng),
        _whole_turns(arm, rng),
        _beyond_limits(arm, rng),
        _out_of_reach(_wide(arm), rng),
    ]


def _of_configurations(name: str, arm: Arm, q: Array, **more: object) -> EdgeSet:
    return EdgeSet(name=name, arm=arm, q=q, X=forward(arm, q), **more)  # type: ignore[arg-type]


def _smallest(arm: Arm, q: Array) -> Array:
    """Return the smallest singular values of the Jacobian (...)."""
    return np.linalg.svd(jacobian(arm, q), compute_uv=False)[..., -1]


def _wide(arm: Arm) -> Arm:
    """The arm with a whole turn for every joint and, where it slides, a boom that reaches through the shoulder."""
    wide = {True: Limits(lower=-np.pi, upper=np.pi), False: Limits(lower=-1.5, upper=1.5)}
    return attrs.evolve(arm, joints=[attrs.evolve(joint, limits=wide[joint.revolute]) for joint in arm.joints])


def _random(arm: Arm, rng: np.random.Generator, count: int, margin: float = 0.0) -> Array:
    """Configurations inside the limits, (count, 6), angles within half a turn."""
    turns = np.array([joint.revolute for joint in arm.joints])
    lower, upper = arm.limits.lower + margin, arm.limits.upper - margin
    lower, upper = np.where(turns, np.maximum(lower, -np.pi), lower), np.where(turns, np.minimum(upper, np.pi), upper)
    return rng.uniform(lower, upper, size=(count, arm.n))


def _grid(arm: Arm) -> list[EdgeSet]:
    steps = []
    for joint in arm.joints:
        step = np.radians(np.arange(-135, 181, 45)) if joint.revolute else np.array((0.3, 0.7, 1.0))
        steps.append(step[(step >= joint.limits.lower) & (step <= joint.limits.upper)])
    q = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, arm.n)
    regular = _smallest(arm, q) > REGULAR
    well, ill = (rows[:: max(1, len(rows) // _GRID)] for rows in (q[regular], q[~regular]))
    return [
        _of_configurations("45° grid, well-conditioned", arm, well),
        _of_configurations("45° grid, singular", arm, ill, own=False),
    ]


def _right_angle(arm: Arm, rng: np.random.Generator) -> EdgeSet:
    q = _random(arm, rng, 4 * _MANY)
    q[:, 1] = np.pi / 2
    return _of_configurations("q2 = 90° exactly", arm, q[_smallest(arm, q) > REGULAR][:_MANY])


def _singular(arm: Arm, rng: np.random.Generator) -> list[EdgeSet]:
    """Sets at and beside each zero of each factor of the determinant."""
    sets, geometry = [], closed_form_geometry(arm)
    names = ("shoulder", "slide" if geometry.family == "stanford" else "elbow", "wrist")
    for k, (factor, joint) in enumerate(zip(names, (1, 2, 4), strict=True)):
        exact = np.array([_zero(arm, geometry, rng, k, joint) for _ in range(_FEW)])
        for decade in DECADES:
            shift = decade * np.eye(arm.n)[joint]
            q = exact if not decade else np.concatenate([exact + shift, exact - shift])
            # At a zero a family may be free, of which any member will do.
            sets.append(_of_configurations(factor, arm, q, own=decade > 0, decade=decade))
    return sets


def _zero(arm: Arm, geometry: ClosedFormGeometry, rng: np.random.Generator, factor: int, joint: int) -> Array:
    """Return a configuration at which one factor vanishes, by the choice of one joint, and the others do not."""
    span = np.linspace(-3.0, 3.0, 60) if arm.joints[joint].revolute else np.linspace(-1.2, 1.2, 60)
    while True:
        q = _random(arm, rng, 1)[0]

        def factors(x: float, q: Array = q) -> list[float]:
            return determinant_factors(geometry, geometry.angles([*q[:joint].tolist(), x, *q[joint + 1 :].tolist()]))

        values = [factors(x)[factor] for x in span.tolist()]
        crossings = [i for i in range(len(span) - 1) if values[i] * values[i + 1] < 0]
        if not crossings:
            continue
        i = rng.choice(crossings)
        q[joint] = brentq(lambda x: factors(x)[factor], span[i], span[i + 1], xtol=1e-16, rtol=8.9e-16)
        # A boom drawn in brings the wrist onto the first axis as well: there the others are looked at further out.
        aside = 0.0 if arm.joints[joint].revolute else 0.5
        if np.delete(np.abs(factors(q[joint] + aside)), factor).min() > _APART:
            return q


def _at_limits(arm: Arm, rng: np.random.Generator) -> EdgeSet:
    found = []
    for joint in range(arm.n):
        for limit in (arm.joints[joint].limits.lower, arm.joints[joint].limits.upper):
            q = _random(arm, rng, 4 * _FEW)
            q[:, joint] = limit
            found.append(q[_smallest(arm, q) > REGULAR][: 2 * _FEW])
    return _of_configurations("one joint at its limit", arm, np.concatenate(found))


def _rounded(arm: Arm, rng: np.random.Generator) -> list[EdgeSet]:
    """Poses typed with some digits; 0.02 m is enough for the rounding to leave them in reach and in the limits."""
    q = _random(arm, rng, 4 * _MANY, margin=_MARGIN)
    q = q[_smallest(arm, q) > 0.02][:_MANY]
    X = forward(arm, q)
    return [
        # A place is off by half a unit along three axes, an orientation by half a unit in nine numbers.
        EdgeSet(name=f"rounded to {n} digits", arm=arm, q=q, X=np.round(X, n), met=1.5 * 10.0**-n, own=False)
        for n in (6, 4)
    ]


def _whole_turns(arm: Arm, rng: np.random.Generator) -> EdgeSet:
    """Configurations with an angle beyond half a turn, where the limits have room for it."""
    q = rng.uniform(arm.limits.lower, arm.limits.upper, size=(100 * _MANY, arm.n))
    turns = np.array([joint.revolute for joint in arm.joints])
    q = q[(np.abs(q[:, turns]) > np.pi).any(axis=-1)]
    q = q[_smallest(arm, q) > REGULAR][:_MANY] if len(q) else q
    return _of_configurations("near a configuration beyond 180°", arm, q, turns=True)


def _beyond_limits(arm: Arm, rng: np.random.Generator) -> EdgeSet:
    """Configurations of which some joint is outside its limits; another branch of the pose may well be inside."""
    q = _random(_wide(arm), rng, 20 * _MANY)
    outside = ((q < arm.limits.lower - 1e-3) | (q > arm.limits.upper + 1e-3)).any(axis=-1)
    q = q[outside & (_smallest(arm, q) > REGULAR)][:_MANY]
    return _of_configurations("made outside the limits", arm, q)


def _out_of_reach(arm: Arm, rng: np.random.Generator) -> EdgeSet:
    """Poses by hand: the wrist nearer to the first axis than the plane of the arm, or farther than the links reach."""
    side, hand = {"puma560": (0.149, 0.0), "stanford": (0.15367, 0.26289), "ur5": (0.10915, 0.0823)}[arm.name]
    links, height = {
        "puma560": (0.432 + np.hypot(0.02, 0.433), 0.0),
        "stanford": (np.inf, 0.4125),
        "ur5": (0.425 + 0.39225 + 0.09465, 0.089159),
    }[arm.name]
    poses = []
    for k in range(_MANY // 2):
        R = rotation_from_vector(rng.normal(size=3))
        short, turn = 10.0 ** rng.uniform(-5, -1.1), rng.uniform(-np.pi, np.pi)
        if k % 2 and np.isfinite(links):
            away = rng.normal(size=3)
            wrist = (np.hypot(links, side) + short) * away / np.linalg.norm(away) + (0.0, 0.0, height)
        else:
            rho = side - short
            wrist = np.array((rho * np.cos(turn), rho * np.sin(turn), height + rng.uniform(-0.5, 0.5)))
        poses.append(homogeneous(R, wrist + hand * R[:, 2]))
    X = np.array(poses)
    return EdgeSet(
        name="out of reach by 0.01 to 80 mm", arm=arm, q=np.zeros((len(X), 6)), X=X, reachable=False, own=False
    )
