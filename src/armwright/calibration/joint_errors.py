"""Error models of joints: compliance under gravity, and the transmission error of gears."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.calibration.chain import JointErrorModel
from armwright.dynamics.shares import gravity_efforts

# Configurations over which the largest effort of gravity is looked for.
_SAMPLES = 500
# Efforts below this part of the arm's largest deflect no joint measurably.
_NEGLIGIBLE = 1e-3
# For so many sets of configurations efforts are cached.
_CACHED = 8


def compliances(arm: Arm) -> tuple[JointErrorModel, ...]:
    """Return a model for each joint that gravity loads: its deflection under the largest effort that gravity makes.

    That effort divided by the deflection is the stiffness of the joint: ``largest_gravity_efforts``. There are none
    where the arm has no masses, or not all are known.

    Source:
        Judd & Knasinski (1990); Dumas et al. (2011).
    """
    if any(link.unknown for link in arm.links):
        return ()
    largest = largest_gravity_efforts(arm)

    # A fit asks for the same configurations again and again, and every joint for the efforts of all.
    @lru_cache(maxsize=_CACHED)
    def efforts(q: bytes) -> Array:
        return gravity_efforts(arm, np.frombuffer(q).reshape(-1, arm.n))

    def compliance(joint: int) -> JointErrorModel:
        def law(q: Array) -> Array:
            return np.asarray(-efforts(q.tobytes())[:, joint] / largest[joint], dtype=np.float64)

        return JointErrorModel(f"joint{joint + 1}.sag", joint, law)

    return tuple(compliance(i) for i in range(arm.n) if largest[i] > _NEGLIGIBLE * largest.max() > 0)


def largest_gravity_efforts(arm: Arm) -> Array:
    """Return (n,) the largest effort of gravity that each joint meets in many configurations [N m] or [N]."""
    lower, upper = ranges(arm)
    q = lower + (upper - lower) * np.random.default_rng(0).random((_SAMPLES, arm.n))
    return np.asarray(np.abs(gravity_efforts(arm, q)).max(axis=0), dtype=np.float64)


def transmission_errors(arm: Arm, order: int) -> tuple[JointErrorModel, ...]:
    """Return two models for each revolute joint: sine and cosine of the ``order``-th harmonic of its transmission.

    Source:
        Whitney, Lozinski, Rourke (1986).
    """

    def harmonic(joint: int, kind: str) -> JointErrorModel:
        function = np.sin if kind == "sin" else np.cos

        def law(q: Array) -> Array:
            return np.asarray(function(order * q[:, joint]), dtype=np.float64)

        return JointErrorModel(f"joint{joint + 1}.{kind}{order}", joint, law)

    return tuple(harmonic(i, kind) for i, joint in enumerate(arm.joints) if joint.revolute for kind in ("sin", "cos"))
