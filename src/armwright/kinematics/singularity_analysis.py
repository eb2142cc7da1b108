"""Singular configurations: which factor of the determinant vanishes, which twists are lost, which motions are idle."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions, single_configuration
from armwright.arrays import Array, ArrayLike, number, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, rotated_about_y
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.manipulability_index import scaled_rows
from armwright.tracing.scalar import Scalar, cos, sin
from armwright.tracing.vectors import Vector


@attrs.frozen(kw_only=True)
class Factor:
    """One factor of the determinant of the Jacobian, or one singular value of an arm whose factors are not known.

    Attributes:
        name: ``shoulder``, ``elbow``, ``slide``, ``wrist``, or ``singular value 6``.
        value: [m], or a plain number for the wrist.
        scale: what it is compared with, in the same unit: its value in a good configuration.
        near: whether it is near zero.
    """

    name: str
    value: float
    scale: float
    near: bool


@attrs.frozen(kw_only=True, eq=False)
class Singularities:
    """How near one configuration is to a singularity, and what that costs.

    Attributes:
        factors: the factors of the determinant, or the singular values, largest first.
        singular_values: (min(6, n)) of the Jacobian with its angular rows in metres, largest first [m].
        lost: (k, 6) twists, base axes, that the tool cannot make: at a right angle to all it can, and to each other.
            At least one where the configuration is singular; with fewer than six joints also those never possible.
        idle: (k, n) joint motions that do not move the tool, each of length 1, at right angles to each other.
            At least one where the configuration is singular; with more than six joints also the self-motions.
    """

    factors: tuple[Factor, ...]
    singular_values: Array = attrs.field(converter=read_only)
    lost: Array = attrs.field(converter=read_only)
    idle: Array = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields

    @property
    def near(self) -> tuple[str, ...]:
        """Names of the factors that are near zero."""
        return tuple(factor.name for factor in self.factors if factor.near)

    @property
    def singular(self) -> bool:
        """Whether any factor is near zero."""
        return bool(self.near)


def determinant_factors(geometry: ClosedFormGeometry, angles: Sequence[Scalar]) -> Vector:
    """Return the three factors of the determinant of the Jacobian, over abstract scalars.

    The determinant is their product, times the length of the upper arm where there is one, with one sign for all
    configurations of an arm:

    - shoulder: distance of the wrist centre from the axis of joint 1, in the plane of the arm; of the PUMA
      a2·c2 + a3·c23 + d4·s23, of the Stanford arm d3·s2;
    - elbow: d4·c3 - a3·s3, how far the forearm is from lying along the upper arm; slide: its length d3;
    - wrist: s5.

    Args:
        geometry: the build.
        angles: six angles of the build.

    Source:
        PUMA: the seed on its differential kinematics. The others: the columns of the Jacobian at the wrist centre.
    """
    _, second, third, fourth, fifth, _ = angles
    if geometry.family == "stanford":
        X, _ = rotated_about_y(second, geometry.forearm[0], third)
        return [geometry.shoulder_offset + X, third, sin(fifth)]
    a3, d4 = geometry.forearm
    upper, _ = rotated_about_y(second, geometry.upper_arm, 0.0)
    fore, _ = rotated_about_y(second + third, a3, d4)
    X = geometry.shoulder_offset + upper + fore
    if geometry.family == "parallel":
        X = X + rotated_about_y(second + third + fourth, *geometry.wrist_link)[0]
    return [X, d4 * cos(third) - a3 * sin(third), sin(fifth)]


def singularity_factors(arm: Arm, q: ArrayLike) -> Array:
    """Return the three factors of the determinant of the Jacobian for many configurations.

    Args:
        arm: an arm of 6 joints with a closed form: see ``find_geometry``.
        q: (..., 6) joint positions [rad] or [m].

    Returns:
        (..., 3): shoulder [m], elbow or slide [m], wrist; see ``determinant_factors``.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        UnsupportedArmError: the arm has no closed form.
        ShapeError: the last axis of ``q`` is not 6 long.
        InvalidValueError: a number is NaN or infinite.
    """
    geometry = find_geometry(known_arm(arm))
    if geometry is None:
        raise UnsupportedArmError(
            f"arm '{arm.name}': no closed-form factors of its Jacobian determinant are known; use the "
            "singular values (singularities, manipulability)"
        )
    q = positions(arm, q)
    return stack(determinant_factors(geometry, geometry.angles(per_joint(q))), q.shape[:-1])


def singularities(arm: Arm, q: ArrayLike, *, threshold: float = 1e-3, length: float = 1.0) -> Singularities:
    """Say how near one configuration is to a singularity, by which factor, what is lost and what moves for nothing.

    Args:
        arm: the arm, with n joints.
        q: (n,) joint positions [rad] or [m].
        threshold: a factor is near zero below this part of its scale: of the farthest reach of the wrist for the
            shoulder (1 m for a slide), of the length of the forearm for the elbow, of 1 m for the slide, of 1 for the
            wrist; a singular value below this part of the largest.
        length: what a rotation by one radian is worth [m], where lengths and rotations are compared.

    Returns:
        Factors, singular values, lost and idle directions.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: ``q`` is not (n,).
        InvalidValueError: a number is NaN or infinite, ``length`` is not above 0, or ``threshold`` not between 0 and 1.

    Source:
        Factors: ``determinant_factors``. Directions: Golub & Van Loan, the singular value decomposition.
    """
    threshold, length = number(threshold, "threshold"), number(length, "length")
    if not 0 < threshold < 1:
        raise InvalidValueError(f"threshold: expected a fraction of the scale between 0 and 1, got {threshold}")
    q = single_configuration(arm, q)
    U, sigma, Vt = np.linalg.svd(scaled_rows(jacobian(arm, q), length))
    small = int(np.count_nonzero(sigma < threshold * sigma[0]))
    factors = _factors(arm, q, threshold) or tuple(
        Factor(name=f"singular value {i}", value=float(value), scale=float(sigma[0]), near=value < threshold * sigma[0])
        for i, value in enumerate(sigma, 1)
    )
    # What the factors call near decides; the singular values say in how many directions.
    rank = len(sigma) - (max(small, 1) if any(factor.near for factor in factors) else 0)
    lost = U[:, rank:].T / np.repeat((1.0, length), 3)
    return Singularities(factors=factors, singular_values=sigma, lost=lost, idle=Vt[rank:])


def _factors(arm: Arm, q: Array, threshold: float) -> tuple[Factor, ...]:
    geometry = find_geometry(arm)
    if geometry is None:
        return ()
    values = singularity_factors(arm, q).tolist()
    reach = geometry.max_reach if np.isfinite(geometry.max_reach) else 1.0
    second, fore = ("slide", 1.0) if geometry.family == "stanford" else ("elbow", float(np.hypot(*geometry.forearm)))
    return tuple(
        Factor(name=name, value=value, scale=scale, near=abs(value) < threshold * scale)
        for name, value, scale in zip(("shoulder", second, "wrist"), values, (reach, fore, 1.0), strict=True)
    )
