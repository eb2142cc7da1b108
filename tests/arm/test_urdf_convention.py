"""Arm files that give joints by their frames and axes, beside Pinocchio, which reads the same numbers as URDF."""

from pathlib import Path

import numpy as np

from armwright.arm.load import read_arm
from armwright.arrays import Array
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from oracles.arms import random_link
from oracles.urdf import RELATIONS, inertial, joint, next_axis, oracle, random_origin, seen_from, written
from samples import Sample

AGREEMENT = 1e-9  # in parts of the largest number


def near(ours: Array, theirs: Array) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=AGREEMENT * np.abs(theirs).max())


def random_chain(rng: np.random.Generator, joints: int) -> tuple[str, str]:
    """One chain as an arm file and as URDF: frames and axes that lie anyhow, and a body behind every joint."""
    toml, urdf = ['convention = "urdf"'], ['<robot name="random"><link name="base"/>']
    place, turned = random_origin(rng)
    toml.append(f"[tool]\nxyz_m = {place.tolist()}\nrpy_rad = {turned.tolist()}")
    last, z = "base", np.array((0.0, 0.0, 1.0))
    for i in range(1, joints + 1):
        kind = str(rng.choice(("revolute", "prismatic")))
        (xyz, rpy), link = random_origin(rng), random_link(rng)
        z = seen_from(rpy, next_axis(rng, z, str(rng.choice(RELATIONS))))
        I = link.inertia
        six = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
        toml.append(
            f'[[joint]]\nkind = "{kind}"\nxyz_m = {xyz.tolist()}\nrpy_rad = {rpy.tolist()}\n'
            f"axis = {(z * rng.uniform(0.5, 2)).tolist()}\n[joint.link]\nmass_kg = {link.mass}\n"
            f"com_m = {link.com.tolist()}\ninertia_kgm2 = {[float(x) for x in six]}"
        )
        inside = f'<axis xyz="{written(z)}"/><limit lower="-2.5" upper="2" effort="80" velocity="2"/>'
        urdf += [f'<link name="link_{i}">{inertial(link, np.zeros(3))}</link>']
        urdf += [joint(f"joint_{i}", kind, (last, f"link_{i}"), (xyz, rpy), inside)]
        last = f"link_{i}"
    urdf += ['<link name="hand"/>', joint("wrist", "fixed", (last, "hand"), (place, turned)), "</robot>"]
    return "\n".join(toml), "\n".join(urdf)


def test_random_chains(sample: Sample, tmp_path: Path) -> None:
    """The arm stands, weighs and moves as Pinocchio says, however its axes lie."""
    for rng in sample.cases(200):
        text, urdf = random_chain(rng, int(rng.integers(1, 9)))
        (tmp_path / "arm.toml").write_text(text, encoding="utf-8")
        arm, known = read_arm(tmp_path / "arm.toml"), oracle(urdf, "hand")
        q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))

        near(forward(arm, q), known.forward(q))
        near(inverse_dynamics(arm, q, qd, qdd), known.inverse_dynamics(q, qd, qdd))
        near(mass_matrix(arm, q), known.mass_matrix(q))
