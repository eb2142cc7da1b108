"""Logs of arms whose numbers are known: smooth motions, their efforts, and what sensors make of both."""

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.identification.log import Log


def truth(name: str = "puma560") -> Arm:
    """An arm of the catalogue with friction of the plain law."""
    arm = load_arm(name)
    dry = np.linspace(4.0, 2.0, arm.n).tolist()
    motors = [Motor(inertia=0.5, viscous=3.0, coulomb_forward=x, coulomb_backward=x, offset=0.3) for x in dry]
    return attrs.evolve(arm, motors=motors)


def fourier(rng: np.random.Generator, n: int, t: Array, size: float = 0.8) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of five harmonics of a period of ten seconds."""
    w = 2 * np.pi / 10 * np.arange(1, 6)
    a, b = size * rng.normal(size=(2, 5, n)) / np.arange(1, 6)[:, None]
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    return s @ a + c @ b, (c * w) @ a - (s * w) @ b, -(s * w**2) @ a - (c * w**2) @ b


def noise(rng: np.random.Generator, shape: tuple[int, int], correlation: float) -> Array:
    """Noise of unit variance whose values hang together."""
    from scipy.signal import lfilter

    white = rng.normal(size=(shape[0] + 200, shape[1]))
    return np.asarray(np.sqrt(1 - correlation**2) * lfilter([1.0], [1.0, -correlation], white, axis=0)[200:])


def log(
    arm: Arm,
    rng: np.random.Generator,
    *,
    seconds: float = 20.0,
    rate: float = 250.0,
    sigma: float = 0.02,
    correlation: float = 0.9,
    resolution: float = 2e-6,
    delay: float = 0.0,
    size: float = 0.8,
) -> Log:
    """A log of an arm; noise is a part of the spread of the efforts of each joint."""
    t = np.arange(0, seconds, 1 / rate)
    state = rng.bit_generator.state
    q, qd, qdd = fourier(rng, arm.n, t, size)
    tau = compile_arm(arm).inverse_dynamics(q, qd, qdd)
    rng.bit_generator.state = state
    late = fourier(rng, arm.n, t - delay, size)[0]
    effort = tau + sigma * tau.std(axis=0) * noise(rng, tau.shape, correlation)
    return Log(name="simulated", t=t, q=np.round(late / resolution) * resolution, effort=effort)
