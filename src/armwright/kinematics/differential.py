"""Joint rates of the PUMA for a twist of its tool, in closed form, by two methods: no matrix is inverted.

Both work at the wrist centre, with the angles of the build (see ``ClosedFormGeometry``) and the letters of the book: p
the wrist centre in the shoulder frame, n, o, a the axes of the last wrist frame, and a d before a letter for its rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias, get_args

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions
from armwright.arrays import LARGEST, Array, ArrayLike, broadcast_rows, of_shape, read_only, reduce_by_fields
from armwright.errors import ArmwrightError, UnsupportedArmError, one_of
from armwright.kinematics.forward_kinematics import link_frames, per_joint, stack, tool_frame
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, rotation_about_z_then_y
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.jacobians import Axes, known_axes
from armwright.kinematics.singularity_analysis import determinant_factors
from armwright.tracing.scalar import Scalar, cos, select, sin
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, product, subtract, transpose

Method: TypeAlias = Literal["blocks", "derivative"]

# A factor of the determinant below this, in metres or as a sine, is taken for zero: of what is divided by it no more
# than some six digits would be left.
SINGULAR_FACTOR = 1e-9
FACTORS = ("shoulder", "elbow", "wrist")


class Motion(NamedTuple):
    """The wrist of a PUMA on the move, over abstract scalars, seen from the shoulder frame.

    ``p`` and ``v``: where its centre is [m] and its speed [m/s]; ``R`` and ``w``: the last wrist frame, columns n, o,
    a, and its angular speed [rad/s].
    """

    p: Vector
    v: Vector
    R: Matrix
    w: Vector


class SingularConfigurationError(ArmwrightError, ValueError):
    """No joint rates make the twist: a factor of the determinant vanishes.

    Attributes:
        factor: ``shoulder``, ``elbow`` or ``wrist``.
    """

    def __init__(self, factor: str, value: float, index: tuple[int, ...]) -> None:
        """Name the factor, its value and which of many configurations it is."""
        self.factor = factor
        which = f"configuration {', '.join(str(i) for i in index)}" if index else "the configuration"
        super().__init__(
            f"{which} is singular at the {factor}: its factor of the determinant is {value:.3g}, expected at least "
            f"{SINGULAR_FACTOR:g}; damped_rates gives bounded rates there"
        )


@attrs.frozen(kw_only=True, eq=False)
class DifferentialInverse:
    """Joint rates, and whether there are any.

    Attributes:
        rates: (..., 6) joint speeds [rad/s]; NaN where the configuration is singular.
        factors: (..., 3) shoulder [m], elbow [m] and wrist: the factors of the determinant.
        singular: (..., 3) which of them vanish.
    """

    rates: Array = attrs.field(converter=read_only)
    factors: Array = attrs.field(converter=read_only)
    singular: npt.NDArray[np.bool_] = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields

    def checked(self) -> Array:
        """Return the rates (..., 6), all of which make their twist.

        Raises:
            SingularConfigurationError: one does not; the text names the factor that vanishes.
        """
        check_regular(self.factors)
        return self.rates


def check_regular(factors: Array) -> None:
    """Refuse configurations whose determinant has a factor (..., 3) that vanishes.

    Raises:
        SingularConfigurationError: one has; the text names the factor.
    """
    for *index, factor in np.argwhere(np.abs(factors) < SINGULAR_FACTOR).tolist():
        raise SingularConfigurationError(FACTORS[factor], float(factors[*index, factor]), tuple(index))


def differential_inverse(
    arm: Arm, q: ArrayLike, twist: ArrayLike, *, method: Method = "blocks", frame: Axes = "base"
) -> DifferentialInverse:
    """Return the joint rates that make a twist of the tool.

    Args:
        arm: an arm built like the PUMA: its axis of joint 4 in the plane of the arm.
        q: (..., 6) joint positions [rad].
        twist: (..., 6) speed of the tool point [m/s], then angular speed [rad/s].
        method: ``blocks`` solves the wrist-partitioned Jacobian block by block; ``derivative`` differentiates the
            closed form of the inverse. They agree.
        frame: whose axes the twist is seen along, ``base`` or ``tool``.

    Returns:
        The rates, the factors of the determinant, and which of those vanish; ``checked()`` gives the rates or names
        the factor.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        UnsupportedArmError: the arm is not built like the PUMA.
        UnknownNameError: there is no such method.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is NaN or infinite, or ``frame`` is neither ``base`` nor ``tool``.

    Source:
        The seed on the differential kinematics of the PUMA, (a) and (b); the illegible inverse of (b) derived anew.
    """
    geometry = puma_geometry(arm, "differential inverse in closed form", "damped_rates")
    one_of("method", method, get_args(Method))
    known_axes(frame)
    q, twist = broadcast_rows("q, twist", positions(arm, q), of_shape(twist, (6,), "twist", LARGEST))
    lead = q.shape[:-1]
    joints, twists = per_joint(q), per_joint(twist)
    angles = geometry.angles(joints)
    solve = rates_by_blocks if method == "blocks" else rates_by_derivative
    rates = solve(geometry, angles, wrist_motion(arm, geometry, joints, twists, frame))
    factors = stack(determinant_factors(geometry, angles), lead)
    singular = np.abs(factors) < SINGULAR_FACTOR
    joint_rates = stack([sign * rate for sign, rate in zip(geometry.signs, rates, strict=True)], lead)
    return DifferentialInverse(
        rates=np.where(singular.any(axis=-1, keepdims=True), np.nan, joint_rates), factors=factors, singular=singular
    )


def puma_geometry(arm: Arm, quantity: str, alternative: str) -> ClosedFormGeometry:
    """Return the build of an arm like the PUMA: its axis of joint 4 in the plane of the arm.

    Args:
        arm: the arm.
        quantity: what there is for such an arm alone, for the message.
        alternative: the function that takes any arm.

    Raises:
        KindError: ``arm`` is no arm.
        UnsupportedArmError: it is built in another way.
    """
    geometry = find_geometry(known_arm(arm))
    if geometry is None or geometry.family != "puma" or not np.array_equal(geometry.R_3W, np.eye(3)):
        raise UnsupportedArmError(
            f"arm '{arm.name}': no {quantity}; expected an arm built like puma560 ({alternative} takes any arm)"
        )
    return geometry


def wrist_motion(arm: Arm, geometry: ClosedFormGeometry, q: Vector, twist: Vector, frame: Axes) -> Motion:
    """Return how the wrist moves for a twist of the tool, over abstract scalars."""
    R_BT, p_BT = tool_frame(arm, link_frames(arm, q)[-1])
    v, w = list(twist[:3]), list(twist[3:])
    if frame == "tool":
        v, w = apply(R_BT, v), apply(R_BT, w)
    lever = apply(R_BT, geometry.p_TW.tolist())
    R_SB = geometry.X_BS[:3, :3].T.tolist()
    return Motion(
        p=apply(R_SB, subtract(add(p_BT, lever), geometry.X_BS[:3, 3].tolist())),
        v=apply(R_SB, add(v, cross(w, lever))),
        R=product(R_SB, product(R_BT, geometry.R_T6.tolist())),
        w=apply(R_SB, w),
    )


def rates_by_blocks(geometry: ClosedFormGeometry, angles: Sequence[Scalar], motion: Motion) -> Vector:
    """Solve the wrist-partitioned Jacobian block by block, over abstract scalars.

    Seen along the axes of frame 3 at the wrist centre, joint 1 alone moves the wrist centre out of the plane of the
    arm, joints 2 and 3 move it in the plane, and joints 4 to 6 make the rotation of the tool that then remains:

        v = [J11 J12 J13]        w = [J41 0 0  0  J45 J46]
            [J21  0   0 ]            [ 0  1 1  0  J55 J56]
            [J31 J32 J33]            [J61 0 0  1   0  J66]

    Args:
        geometry: a ``puma``.
        angles: six angles of the build.
        motion: of the wrist.

    Returns:
        Rates of the six angles; without meaning, but finite, where a factor of the determinant vanishes.

    Source:
        The seed on the differential kinematics of the PUMA, method (b); its J21 has the shoulder's offset added here.
    """
    a2, (a3, d4) = geometry.upper_arm, geometry.forearm
    _, t2, t3, t4, t5, _ = angles
    c2, c3, s3, c4, s4, c5, s5 = cos(t2), cos(t3), sin(t3), cos(t4), sin(t4), cos(t5), sin(t5)
    R_S3 = rotation_about_z_then_y(angles[0], angles[1] + angles[2])
    v, w = apply(transpose(R_S3), motion.v), apply(transpose(R_S3), motion.w)
    J41, J61 = R_S3[2][0], R_S3[2][2]
    J11, J31 = -J61 * geometry.plane_offset, J41 * geometry.plane_offset
    J21 = geometry.shoulder_offset + a2 * c2 + a3 * J61 - d4 * J41
    J12, J32 = a2 * s3 + d4, -a2 * c3 - a3
    J13, J33 = d4, -a3
    J45, J55, J46, J56, J66 = -s4, c4, c4 * s5, s4 * s5, c5
    d1 = v[1] / _safe(J21)
    x, z = v[0] - J11 * d1, v[2] - J31 * d1
    plane = a2 * _safe(d4 * c3 - a3 * s3)  # J12 J33 - J13 J32
    d2, d3 = (J33 * x - J13 * z) / plane, (J12 * z - J32 * x) / plane
    x, y, z = w[0] - J41 * d1, w[1] - d2 - d3, w[2] - J61 * d1
    d6 = (J55 * x - J45 * y) / _safe(s5)  # J46 J55 - J45 J56
    d5 = J45 * x + J55 * y - (J45 * J46 + J55 * J56) * d6
    return [d1, d2, d3, z - J66 * d6, d5, d6]


def rates_by_derivative(geometry: ClosedFormGeometry, angles: Sequence[Scalar], motion: Motion) -> Vector:
    """Differentiate the closed form of the inverse, joint by joint in its order, over abstract scalars.

    Each line of the inverse gives one rate: side = -s1 px + c1 py that of joint 1, the distance of the wrist centre
    from joint 2 that of joint 3, its direction that of joint 2, and the three quotients tan t4, tan t5 and tan t6 those
    of the wrist.

    Args:
        geometry: a ``puma``.
        angles: six angles of the build.
        motion: of the wrist.

    Returns:
        Rates of the six angles; without meaning, but finite, where a factor of the determinant vanishes.

    Source:
        The seed on the differential kinematics of the PUMA, method (a); joint 2 by its atan2 of Paul (1981).
    """
    a2, (a3, d4) = geometry.upper_arm, geometry.forearm
    t1, _, t3, t4, t5, _ = angles
    c1, s1, c3, s3 = cos(t1), sin(t1), cos(t3), sin(t3)
    px, py, Z = motion.p
    vx, vy, dZ = motion.v
    # -s1 px + c1 py = side
    out = c1 * px + s1 * py
    d1 = (-s1 * vx + c1 * vy) / _safe(out)
    X, dX = out - geometry.shoulder_offset, c1 * vx + s1 * vy + geometry.plane_offset * d1
    # a3 c3 + d4 s3 = (X² + Z² - a2² - a3² - d4²) / 2 a2
    elbow = _safe(d4 * c3 - a3 * s3)
    d3 = (X * dX + Z * dZ) / (a2 * elbow)
    # t2 = atan2(-Z, X) - atan2(v, u), and both points are equally far from joint 2
    u, v = a2 + a3 * c3 + d4 * s3, a3 * s3 - d4 * c3
    square = u * u + v * v
    square = select(square < SINGULAR_FACTOR**2, 1.0, square)
    d2 = (Z * dX - X * dZ) / square - (u * (u - a2) + v * v) * d3 / square
    return [d1, d2, d3, *_wrist_rates(angles, [d1, d2 + d3], motion, _safe(sin(t5)), (cos(t4), sin(t4)))]


def _wrist_rates(
    angles: Sequence[Scalar], first: Sequence[Scalar], motion: Motion, s5: Scalar, fourth: tuple[Scalar, Scalar]
) -> Vector:
    """Differentiate the quotients of joints 4 to 6, seen from the forearm that rotates with ``first``."""
    d1, d23 = first
    c4, s4 = fourth
    c5 = cos(angles[4])
    R_S3 = rotation_about_z_then_y(angles[0], angles[1] + angles[2])
    # The forearm turns about z of the shoulder with joint 1 and about its own y with joints 2 and 3.
    w_3 = [R_S3[0][1] * d23, R_S3[1][1] * d23, d1]
    n, o, a = transpose(motion.R)
    R_3S = transpose(R_S3)
    turning = subtract(motion.w, w_3)
    dn, do, da = (apply(R_3S, cross(turning, axis)) for axis in (n, o, a))
    n, o, a = (apply(R_3S, axis) for axis in (n, o, a))
    # tan t4 = ay / ax, and ax² + ay² = s5²
    d4 = (a[0] * da[1] - a[1] * da[0]) / (s5 * s5)
    # tan t5 = (c4 ax + s4 ay) / az; its change with t4 is c4 ay - s4 ax = 0
    d5 = c5 * (c4 * da[0] + s4 * da[1]) - (c4 * a[0] + s4 * a[1]) * da[2]
    # tan t6 = (c4 ny - s4 nx) / (c4 oy - s4 ox), the sine and the cosine of t6
    s6, c6 = c4 * n[1] - s4 * n[0], c4 * o[1] - s4 * o[0]
    ds6 = c4 * dn[1] - s4 * dn[0] - d4 * (s4 * n[1] + c4 * n[0])
    dc6 = c4 * do[1] - s4 * do[0] - d4 * (s4 * o[1] + c4 * o[0])
    return [d4, d5, dot([c6, -s6], [ds6, dc6])]


def _safe(factor: Scalar) -> Scalar:
    """Return a factor, or 1 where it vanishes and the result has no meaning."""
    return select(abs(factor) < SINGULAR_FACTOR, 1.0, factor)
