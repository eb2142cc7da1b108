"""Random URDF files, and what Pinocchio makes of them."""

from collections.abc import Sequence

import attrs
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from armwright.arm.model import STANDARD_GRAVITY, Link
from armwright.arrays import Array
from oracles.arms import random_link

# How the axis of a joint lies to the one before it.
RELATIONS = ("skew", "parallel", "anti-parallel", "meeting", "in line", "at a right angle")
KINDS = ("revolute", "continuous", "prismatic")


def written(numbers: Array) -> str:
    return " ".join(map(repr, map(float, numbers)))


def inertial(link: Link, rpy: Array) -> str:
    """A body whose tensor is given along axes turned by rpy."""
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    I = R.T @ link.inertia @ R
    numbers = {"ixx": I[0, 0], "iyy": I[1, 1], "izz": I[2, 2], "ixy": I[0, 1], "ixz": I[0, 2], "iyz": I[1, 2]}
    tensor = " ".join(f'{key}="{float(value)!r}"' for key, value in numbers.items())
    return (
        f'<inertial><origin xyz="{written(link.com)}" rpy="{written(rpy)}"/><mass value="{float(link.mass)!r}"/>'
        f"<inertia {tensor}/></inertial>"
    )


def random_body(rng: np.random.Generator, name: str) -> str:
    return f'<link name="{name}">{inertial(random_link(rng), rng.uniform(-3, 3, size=3))}</link>'


def joint(name: str, kind: str, ends: tuple[str, str], origin: tuple[Array, Array], inside: str = "") -> str:
    """A joint from the first link to the second, whose origin is given as xyz and rpy."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'<origin xyz="{written(origin[0])}" rpy="{written(origin[1])}"/>{inside}</joint>'
    )


def random_urdf(rng: np.random.Generator, plan: Sequence[tuple[str, str]]) -> str:
    """A chain with one joint of each (kind, relation) planned, with fixed links in it and beside it.

    The last link is called ``hand``. Every link has a mass, the base too.
    """
    parts = ['<robot name="random">', random_body(rng, "base")]
    last, z, plates = "base", np.array((0.0, 0.0, 1.0)), 0
    for i, (kind, relation) in enumerate(plan, 1):
        for _ in range(rng.integers(0, 3)):  # fixed links on the way
            plates += 1
            place = rng.normal(scale=0.3, size=3) if relation in {"skew", "parallel"} else rng.normal() * z
            rpy = rng.uniform(-3, 3, size=3)
            parts += [random_body(rng, f"plate_{plates}")]
            parts += [joint(f"weld_{plates}", "fixed", (last, f"plate_{plates}"), (place, rpy))]
            last, z = f"plate_{plates}", seen_from(rpy, z)
        rpy = rng.uniform(-3, 3, size=3)
        place = rng.normal() * z if relation in {"meeting", "in line"} else rng.normal(scale=0.3, size=3)
        z = seen_from(rpy, next_axis(rng, z, relation))
        inside = f'<axis xyz="{written(z)}"/><limit lower="-2.5" upper="2" effort="80" velocity="2"/>'
        parts += [random_body(rng, f"link_{i}")]
        parts += [joint(f"joint_{i}", kind, (last, f"link_{i}"), (place, rpy), inside)]
        last = f"link_{i}"
        if rng.random() < 0.5:  # a box screwed on
            parts += [random_body(rng, f"box_{i}")]
            parts += [joint(f"screw_{i}", "fixed", (last, f"box_{i}"), random_origin(rng))]
    parts += [random_body(rng, "hand"), joint("wrist", "fixed", (last, "hand"), random_origin(rng)), "</robot>"]
    return "\n".join(parts)


def next_axis(rng: np.random.Generator, z: Array, relation: str) -> Array:
    """The direction of the axis after z, seen from the same frame."""
    across = np.cross(z, rng.normal(size=3))
    u = {
        "parallel": z,
        "anti-parallel": -z,
        "in line": z * rng.choice((-1, 1)),
        "at a right angle": across,
    }.get(relation, rng.normal(size=3))
    return np.asarray(u / np.linalg.norm(u))


def seen_from(rpy: Array, z: Array) -> Array:
    """A direction, seen from a frame that is turned."""
    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix().T @ z)


def random_origin(rng: np.random.Generator) -> tuple[Array, Array]:
    return rng.normal(scale=0.2, size=3), rng.uniform(-3, 3, size=3)


@attrs.frozen(kw_only=True, eq=False)
class Oracle:
    """A URDF file in Pinocchio, read by its own parser.

    Attributes:
        model: the model.
        data: its scratch space.
        tool: number of the frame of the tip.
    """

    model: pin.Model
    data: pin.Data
    tool: int

    def positions(self, q: Array) -> Array:
        """Joint positions as Pinocchio wants them: cosine and sine of joints that turn without end."""
        parts = [
            [float(x)] if joint.nq == 1 else [np.cos(x), np.sin(x)]
            for x, joint in zip(q, list(self.model.joints)[1:], strict=True)
        ]
        return np.array([x for part in parts for x in part])

    def forward(self, q: Array) -> Array:
        """Pose of the tip (4, 4)."""
        pin.framesForwardKinematics(self.model, self.data, self.positions(q))
        return np.array(self.data.oMf[self.tool].homogeneous)

    def jacobian(self, q: Array) -> Array:
        """Jacobian of the tip along base axes (6, n)."""
        J = pin.computeFrameJacobian(
            self.model, self.data, self.positions(q), self.tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        return np.array(J).reshape(6, self.model.nv)

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Efforts of a motion, without drives (n,)."""
        return np.array(pin.rnea(self.model, self.data, self.positions(q), qd, qdd))

    def mass_matrix(self, q: Array) -> Array:
        """Mass matrix, without drives (n, n)."""
        upper = np.triu(pin.crba(self.model, self.data, self.positions(q)))
        return np.array(upper + np.triu(upper, 1).T)


def oracle(text: str, tip: str) -> Oracle:
    """Let Pinocchio read a URDF text."""
    model = pin.buildModelFromXML(text)
    model.gravity.linear = np.array((0.0, 0.0, -STANDARD_GRAVITY))
    return Oracle(model=model, data=model.createData(), tool=model.getFrameId(tip, pin.FrameType.BODY))
