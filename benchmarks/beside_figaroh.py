"""Identification beside FIGAROH, in an environment that has both: base parameters, held-out errors, and intervals.

    python benchmarks/beside_figaroh.py --data DIR

DIR holds ``ur10e/``. FIGAROH's regressor and base parameters get the motions that armwright prepares of the logs, so
that what differs is the fit: weighted least squares, whose errors take residuals for independent. Its friction is
viscous and Coulomb with an offset, and armwright's is held to that.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import tempfile
from pathlib import Path

import attrs
import numpy as np
import pinocchio as pin
from figaroh.tools.qrdecomposition import get_baseIndex
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate
from scipy.signal import lfilter

from armwright.arm.drive import Motor
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arm.urdf.reader import load_urdf
from armwright.arm.urdf.writer import urdf_text
from armwright.compiled.arm import compile_arm
from armwright.dynamics.regressors import dynamic_parameters
from armwright.identification import identify, motions
from armwright.identification.friction import LAWS, predicted
from armwright.identification.log import Log
from armwright.identification.signals import low_pass
from identification import HELD_OUT, TRAINING, ur10e_log

_CONFIG = {
    "has_friction": True, "has_actuator_inertia": True, "has_joint_offset": True, "is_joint_torques": True,
    "is_external_wrench": False, "force_torque": None, "act_idxv": list(range(6)),
}  # fmt: skip
_LAWS = LAWS[1:2]
_LOGS = 12


class Figaroh:
    """FIGAROH's columns and fit of an arm."""

    def __init__(self, urdf: Path) -> None:
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.data, self.nq, self.nv = self.model.createData(), self.model.nq, self.model.nv
        Y = self._all(*np.random.default_rng(0).uniform(-3, 3, size=(3, 200, self.nv)))
        names = {f"p{k}": 0.0 for k in range(Y.shape[1])}
        dropped, left = get_index_eliminate(Y, names, 1e-6)
        chosen = get_baseIndex(build_regressor_reduced(Y, dropped), left)
        kept = [k for k in range(Y.shape[1]) if k not in dropped]
        self.base = [kept[k] for k in chosen]

    def _all(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return build_regressor_basic(self, q, qd, qdd, _CONFIG)

    def columns(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        """Return the base columns (n k, b), joint after joint."""
        return self._all(q, qd, qdd)[:, self.base]

    def true_values(self, full: np.ndarray) -> np.ndarray:
        """Return the base parameters (b,) of all parameters: bodies, viscous, Coulomb, rotor, offset."""
        Y = self._all(*np.random.default_rng(1).uniform(-3, 3, size=(3, 200, self.nv)))
        return np.linalg.lstsq(Y[:, self.base], Y @ full, rcond=None)[0]


def weighted(A: np.ndarray, tau: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the parameters by weighted least squares, and their standard errors, as FIGAROH has them."""
    x = np.linalg.lstsq(A, tau, rcond=None)[0]
    sigma = np.sqrt(((tau - A @ x).reshape(n, -1) ** 2).mean(axis=1))
    weights = np.repeat(1 / sigma, len(tau) // n)
    x = np.linalg.lstsq(A * weights[:, None], tau * weights, rcond=None)[0]
    return x, np.sqrt(np.linalg.inv((A * weights[:, None]).T @ (A * weights[:, None])).diagonal())


def ur10e(folder: Path) -> None:
    """Print held-out errors of both fits."""
    arm = load_urdf(folder / "ur10e.urdf")
    logs = [ur10e_log(folder, name) for name in TRAINING]
    found = identify(arm, logs, laws=_LAWS)
    even = ur10e_log(folder, HELD_OUT, slice(699, 4200)).even()
    smooth = attrs.evolve(even, effort=low_pass(even.effort, 0.2 / (2 * even.period), 1 / even.period))
    (held,) = motions([smooth], attrs.evolve(found.preparation, border=0.2))
    own = held.tau - predicted(found.model, found.fit.values, held, found.preparation.slow, found.held)
    print("UR10e, held out:", np.sqrt((own**2).mean(axis=0)).round(2))
    other = Figaroh(folder / "ur10e.urdf")
    links = sum(k < 60 or 72 <= k < 78 for k in other.base)
    fitted = list(motions([log.moving() for log in logs], found.preparation))
    q, qd, qdd, tau = (np.concatenate([getattr(m, name) for m in fitted]) for name in ("q", "qd", "qdd", "tau"))
    x, _ = weighted(other.columns(q, qd, qdd), tau.T.ravel(), 6)
    left = (held.tau.T.ravel() - other.columns(held.q, held.qd, held.qdd) @ x).reshape(6, -1)
    print(f"  FIGAROH, {links} base parameters of links and rotors:", np.sqrt((left**2).mean(axis=1)).round(2))


def intervals() -> None:
    """Print how often intervals of 90 % hold the truth, of simulated logs of a PUMA with noise that hangs together."""
    arm = load_arm("puma560")
    motor = Motor(inertia=0.5, viscous=3.0, coulomb_forward=3.0, coulomb_backward=3.0, offset=0.3)
    arm = attrs.evolve(arm, motors=[motor] * 6)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "puma.urdf"
        path.write_text(urdf_text(arm), encoding="utf-8")
        other = Figaroh(path)
    bodies = np.concatenate([body.toDynamicParameters() for body in other.model.inertias[1:]])
    true = other.true_values(np.concatenate([bodies, *np.repeat([[3.0], [3.0], [0.5], [0.3]], 6, axis=1)]))
    drives = np.tile([0.5, 3.0, 3.0, 0.3], 6)
    own_z, other_z = [], []
    for seed in range(_LOGS):
        log = _log(arm, np.random.default_rng(seed))
        found = identify(arm, [log], laws=_LAWS, delay=0.0)
        expected = found.model.base.combinations @ [*dynamic_parameters(arm)[:60], *drives]
        own_z.append((found.fit.values - expected) / found.fit.errors)
        (motion,) = motions([log.moving()], found.preparation)
        x, errors = weighted(other.columns(motion.q, motion.qd, motion.qdd), motion.tau.T.ravel(), 6)
        other_z.append((x - true) / errors)
    for name, z in (("armwright", own_z), ("FIGAROH", other_z)):
        print(f"90 % intervals of {name} hold {np.mean(np.abs(z) < 1.645):.0%} of {np.size(z)} base parameters")


def _log(arm: Arm, rng: np.random.Generator) -> Log:
    t, w = np.arange(0, 20, 1 / 250), 2 * np.pi / 10 * np.arange(1, 6)
    a, b = 0.8 * rng.normal(size=(2, 5, arm.n)) / np.arange(1, 6)[:, None]
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, qd, qdd = s @ a + c @ b, (c * w) @ a - (s * w) @ b, -(s * w**2) @ a - (c * w**2) @ b
    tau = compile_arm(arm).inverse_dynamics(q, qd, qdd)
    noise = lfilter([np.sqrt(1 - 0.81)], [1, -0.9], rng.normal(size=tau.shape), axis=0)
    return Log(name="simulated", t=t, q=np.round(q / 2e-6) * 2e-6, effort=tau + 0.02 * tau.std(axis=0) * noise)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with ur10e/")
    ur10e(parser.parse_args().data / "ur10e")
    intervals()
