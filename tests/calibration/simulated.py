"""Arms that are not quite as they are said to be, and points measured of them."""

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.calibration.chain import Chain
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector

# Errors of a good arm before it is calibrated [m], [rad].
LENGTH, ANGLE = 5e-4, 2e-3


def random_arm(rng: np.random.Generator, n: int, *, slides: bool = False) -> Arm:
    """Return an arm of n joints whose axes are skew, at right angles, or parallel; tool and base anywhere."""
    joints = []
    for i in range(n):
        alpha = rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(0.3, 1.2)])
        prismatic = slides and i > 0 and rng.random() < 0.3
        joints.append(
            Joint(
                kind="prismatic" if prismatic else "revolute",
                theta=rng.uniform(-1, 1),
                d=rng.uniform(0.05, 0.4),
                a=rng.uniform(0.1, 0.4) * rng.choice([-1, 1]),
                alpha=alpha,
            )
        )
    return Arm(name=f"random-{n}", joints=joints, base=random_pose(rng, 0.3), tool=random_pose(rng, 0.15))


def random_pose(rng: np.random.Generator, reach: float) -> Array:
    """Return a pose that is turned anyhow and somewhere within reach [m]."""
    return homogeneous(rotation_from_vector(rng.uniform(-1, 1, 3)), rng.uniform(-reach, reach, 3))


def random_errors(rng: np.random.Generator, chain: Chain, scale: float = 1.0) -> Array:
    """Return (k,) errors of a usual size."""
    return np.asarray(rng.standard_normal(len(chain.names)) * np.where(chain.is_length, LENGTH, ANGLE) * scale)


def configurations(rng: np.random.Generator, arm: Arm, m: int) -> Array:
    """Return (m, n) configurations all over an arm's room, slides within 0.3 m."""
    turns = rng.uniform(-2.5, 2.5, (m, arm.n))
    slides = rng.uniform(0.0, 0.3, (m, arm.n))
    return np.where([joint.revolute for joint in arm.joints], turns, slides)


def seen(chain: Chain, q: Array, errors: Array, noise: float, rng: np.random.Generator) -> Array:
    """Return (m, 3) where a measurement with noise [m] sees the tool of an arm with errors."""
    return np.asarray(chain.forward(q, errors).position + noise * rng.standard_normal((len(q), 3)))
