"""The dynamics of modified Denavit-Hartenberg tables, and the PUMA 560 as it was published in one."""

import math
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.dh import from_modified
from armwright.arm.load import load_arm, read_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward import forward
from oracles.arms import random_arm

# Products of a dozen transforms with lengths of some metres.
ROUNDING = 1e-12
# Relative to the largest effort, as for standard arms.
AGREEMENT = 1e-10


def in_front(joint: Joint) -> pin.SE3:
    """What stands in front of joint i in Craig's convention: Rx(alpha) Tx(a) Rz(theta) Tz(d)."""
    x, z = np.array((1.0, 0, 0)), np.array((0, 0, 1.0))
    turn = pin.SE3(pin.AngleAxis(joint.alpha, x).matrix(), joint.a * x)
    return turn * pin.SE3(pin.AngleAxis(joint.theta, z).matrix(), joint.d * z)


def in_pinocchio(table: Arm) -> pin.Model:
    """A modified table in Pinocchio: joint i turns or slides on the z axis of frame i, and link i is seen from it."""
    model, parent, base = pin.Model(), 0, pin.SE3(table.base)
    for i, (joint, link) in enumerate(zip(table.joints, table.links, strict=True)):
        kind = pin.JointModelRZ() if joint.revolute else pin.JointModelPZ()
        parent = model.addJoint(parent, kind, base * in_front(joint), f"joint {i + 1}")
        model.appendBodyToJoint(parent, pin.Inertia(link.mass, link.com, link.inertia), pin.SE3.Identity())
        base = pin.SE3.Identity()
    model.gravity.linear = table.gravity.copy()
    return model


@pytest.mark.parametrize("joints", range(1, 8))
def test_against_pinocchio(joints: int, rng: np.random.Generator) -> None:
    """Pinocchio, given the modified frames themselves, has the hand there and asks those efforts."""
    for _ in range(3):
        table = random_arm(rng, joints)
        before, rows, links = from_modified(table.joints, table.links)
        arm = attrs.evolve(table, joints=rows, links=links, base=table.base @ before)
        model = in_pinocchio(table)
        data = model.createData()
        for q, qd, qdd in rng.uniform(-2, 2, size=(5, 3, joints)):
            expected = pin.rnea(model, data, q, qd, qdd)
            pin.forwardKinematics(model, data, q)
            hand = data.oMi[joints].homogeneous @ table.tool

            tau = inverse_dynamics(arm, q, qd, qdd, drives=False)

            np.testing.assert_allclose(forward(arm, q), hand, atol=100 * ROUNDING)
            np.testing.assert_allclose(tau, expected, atol=AGREEMENT * max(1.0, np.abs(expected).max()))


def test_right_angles_stay_exact() -> None:
    """Twists of right angles leave the base and the centres of mass free of rounding."""
    rows = [Joint(kind="revolute", alpha=math.pi / 2, a=0.1), Joint(kind="revolute", alpha=-math.pi / 2, a=0.2)]

    before, joints, links = from_modified(rows, [Link(mass=1, com=[0, 0, 0.3]), Link()])

    np.testing.assert_array_equal(before, [[1, 0, 0, 0.1], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    assert [(joint.a, joint.alpha) for joint in joints] == [(0.2, -math.pi / 2), (0.0, 0.0)]
    # Frame 1 moves by 0.2 along x and turns by -90 degrees about it: what was z is minus y there.
    np.testing.assert_array_equal(links[0].com, (-0.2, -0.3, 0))


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
