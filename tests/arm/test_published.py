"""The numbers of the catalogue that were published in another form: other frames, four rows, two appendices."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm, read_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward

# Products of a dozen transforms with lengths of some metres.
ROUNDING = 1e-12
# Relative to the largest effort.
AGREEMENT = 1e-10


def published_rows(*, shoulder: float) -> list[tuple[Any, ...]]:
    """Armstrong, Khatib & Burdick (1986) with the lengths of the catalogue.

    Alpha [deg] and a [m] in front, d [m], mass [kg], centre of mass [m], moments about it [kg m²]. The shoulder offset
    of 149 mm is split: d2 stands in front of link 2, the rest behind it.
    """
    return [
        (0, 0, 0, 0, (0, 0, 0), (0, 0, 0.35)),
        (-90, 0, shoulder, 17.40, (0.068, 0.006, -0.016), (0.130, 0.524, 0.539)),
        (0, 0.432, 0.149 - shoulder, 4.80, (0, -0.070, 0.014), (0.066, 0.0125, 0.086)),
        (90, -0.02, 0.433, 0.82, (0, 0, -0.019), (1.8e-3, 1.8e-3, 1.3e-3)),
        (-90, 0, 0, 0.34, (0, 0, 0), (0.3e-3, 0.3e-3, 0.4e-3)),
        (90, 0, 0, 0.09, (0, 0, 0.032), (0.15e-3, 0.15e-3, 0.04e-3)),
    ]


def published_puma(folder: Path, *, shoulder: float = 0.2435) -> Arm:
    """The PUMA 560 in the frames in which its masses were published, read from an arm file."""
    text = 'convention = "modified"\n'
    for alpha, a, d, mass, com, inertia in published_rows(shoulder=shoulder):
        text += f'[[joint]]\nkind = "revolute"\nalpha_deg = {alpha}\na_m = {a}\nd_m = {d}\n'
        text += f"[joint.link]\nmass_kg = {mass}\ncom_m = {list(com)}\ninertia_kgm2 = {list(inertia)}\n"
    (folder / "published.toml").write_text(text)
    return read_arm(folder / "published.toml")


def test_puma_at_rest(tmp_path: Path, rng: np.random.Generator) -> None:
    """The catalogue's PUMA, written in standard frames by hand, weighs on its joints as the published one does."""
    published, catalogue = published_puma(tmp_path), load_arm("puma560")
    q = rng.uniform(-2, 2, size=(50, 6))

    holding = inverse_dynamics(published, q, 0 * q, 0 * q, drives=False)

    assert np.abs(holding[:, 1]).max() > 40  # N m: the shoulder carries the arm
    np.testing.assert_allclose(forward(catalogue, q), forward(published, q), atol=ROUNDING)
    np.testing.assert_allclose(inverse_dynamics(catalogue, q, 0 * q, 0 * q, drives=False), holding, atol=AGREEMENT * 40)


def test_puma_in_motion(tmp_path: Path, rng: np.random.Generator) -> None:
    """In motion, too, it takes the efforts of the published one; with the mass of link 2 elsewhere it would not."""
    q, qd, qdd = rng.uniform(-2, 2, size=(3, 50, 6))

    tau = inverse_dynamics(load_arm("puma560"), q, qd, qdd, drives=False)

    expected = inverse_dynamics(published_puma(tmp_path), q, qd, qdd, drives=False)
    np.testing.assert_allclose(tau, expected, atol=AGREEMENT * np.abs(expected).max())
    other = inverse_dynamics(published_puma(tmp_path, shoulder=0.149), q, qd, qdd, drives=False)
    assert np.abs(tau - other).max() > 1


def test_puma_drives() -> None:
    """Armstrong, Khatib & Burdick's masses, inertias of motor and gear at the joint, and break-away torques."""
    arm = load_arm("puma560")

    assert [link.mass for link in arm.links] == [0, 17.40, 4.80, 0.82, 0.34, 0.09]
    assert [motor.inertia for motor in arm.motors] == [1.14, 4.71, 0.827, 0.2, 0.179, 0.193]
    assert [motor.coulomb_forward for motor in arm.motors] == [6.3, 5.5, 2.6, 1.3, 1.0, 1.2]
    assert [motor.coulomb_backward for motor in arm.motors] == [6.3, 5.5, 2.6, 1.3, 1.0, 1.2]


@pytest.mark.parametrize("name", ["stanford", "stanford-jpl"])
def test_stanford_bodies(name: str) -> None:
    """Appendix II's masses and centres of mass, link 5 with the 0.63 kg of the report's own program."""
    arm = load_arm(name)

    assert [link.mass for link in arm.links] == [9.29, 5.505, 4.25, 1.08, 0.63, 0.51]
    coms = [(0, 17.5, -110.5), (0, -105.4, -7.9), (0, 0, -644.7), (0, 9.2, -5.4), (0, 0.3, 56.6), (0, 1.4, -92.2)]
    np.testing.assert_allclose([1e3 * link.com for link in arm.links], coms, atol=ROUNDING)


def test_four_rows_of_the_thesis(rng: np.random.Generator) -> None:
    """The hand of the NTU arm is where the four rows of table 2.1, the fourth joint at 0, put it."""
    rows = [(0, 0.076, 0, 90), (90, 0, 0.4, 0), (0, -0.012, 0, 90), (0, 0.3543, 0, 90)]  # theta, d, a, alpha

    def transform(theta: float, d: float, a: float, alpha: float) -> Array:
        c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
        return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])

    for q in rng.uniform(-3, 3, size=(20, 3)):
        expected = np.eye(4)
        for (theta, d, a, alpha), position in zip(rows, (*q, 0), strict=True):
            expected = expected @ transform(math.radians(theta) + position, d, a, math.radians(alpha))

        np.testing.assert_allclose(forward(load_arm("ntu-3r"), q), expected, atol=ROUNDING)
