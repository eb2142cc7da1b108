"""Joint rates for a twist of the tool that stay bounded at and near singular configurations."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import LARGEST, Array, ArrayLike, broadcast_rows, number, of_shape, read_only, reduce_by_fields
from armwright.errors import InvalidValueError
from armwright.kinematics.jacobians import Axes, jacobian, known_axes
from armwright.kinematics.manipulability_index import scaled_rows


@attrs.frozen(kw_only=True, eq=False)
class DampedRates:
    """Joint rates for a twist, and what they leave undone.

    Attributes:
        rates: (..., n) joint speeds [rad/s] or [m/s].
        error: (..., 6) the twist asked for less the twist made [m/s] and [rad/s], in the axes of the twist.
        bound: (...) what the length of ``rates`` cannot pass.
        smallest: (...) smallest singular value of the Jacobian, angular rows in metres [m].
    """

    rates: Array = attrs.field(converter=read_only)
    error: Array = attrs.field(converter=read_only)
    bound: Array = attrs.field(converter=read_only)
    smallest: Array = attrs.field(converter=read_only)

    __reduce__ = reduce_by_fields


def damped_rates(
    arm: Arm, q: ArrayLike, twist: ArrayLike, *, damping: float = 0.05, length: float = 1.0, frame: Axes = "base"
) -> DampedRates:
    """Return joint rates that make a twist of the tool, or come near it where the configuration is nearly singular.

    Along a direction in which the arm moves the tool well, with a singular value s of ``damping`` or more, the twist
    is met exactly. Below that the gain is 2 s / (s² + damping²) instead of 1 / s: it goes on from 1 / damping
    without a jump and falls to 0 with s. So no gain passes 1 / damping and

        |rates| ≤ |twist| / damping,

    the twist measured with its rotation in metres (times ``length``). The part (damping² - s²) / (damping² + s²) of the
    twist along that direction is left undone.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        twist: (..., 6) speed of the tool point [m/s], then angular speed [rad/s].
        damping: singular value at which damping begins [m].
        length: what a rotation by one radian is worth [m].
        frame: whose axes the twist is seen along, ``base`` or ``tool``.

    Returns:
        The rates, of least length where joints are redundant; the error they leave, the bound, the smallest singular
        value.

    Raises:
        KindError: ``arm`` is no arm, or an argument something else than real numbers.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is NaN or infinite, ``damping`` or ``length`` is not above 0, or ``frame`` is
            neither ``base`` nor ``tool``.

    Source:
        Nakamura & Hanafusa (1986), with the damping of Chiaverini (1997) that depends on the singular values, taken for
        each direction by itself (Maciejewski & Klein 1988, numerical filtering): damping² · (1 - s²/damping²) / 2 in
        the damped inverse s / (s² + ...) is the gain above.
    """
    known_axes(frame)
    damping, length = number(damping, "damping"), number(length, "length")
    if not 0 < damping < np.inf:
        raise InvalidValueError(f"damping: expected a singular value above 0, where damping begins, got {damping}")
    q, twist = broadcast_rows("q, twist", positions(arm, q), of_shape(twist, (6,), "twist", LARGEST))
    J = jacobian(arm, q, frame)
    weight = np.repeat((1.0, length), 3)
    U, sigma, Vt = np.linalg.svd(scaled_rows(J, length), full_matrices=False)
    gain = np.where(sigma < damping, 2 * sigma / (sigma**2 + damping**2), 1 / np.maximum(sigma, damping))
    along = (np.swapaxes(U, -1, -2) @ (twist * weight)[..., None])[..., 0]
    rates = (np.swapaxes(Vt, -1, -2) @ (gain * along)[..., None])[..., 0]
    return DampedRates(
        rates=rates,
        error=twist - (J @ rates[..., None])[..., 0],
        bound=np.linalg.norm(twist * weight, axis=-1) / damping,
        smallest=np.asarray(sigma[..., -1]),
    )
