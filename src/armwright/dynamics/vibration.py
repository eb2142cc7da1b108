"""How an arm with flexible gears vibrates and yields along a motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, Numbers, evenly_spread, floats, joint_array
from armwright.dynamics.flexible_joints import Modes, deflection, joint_stiffness, modes, tool_compliance
from armwright.errors import ShapeError, TooFewError
from armwright.files.result_table import ResultTable
from armwright.kinematics.jacobians import jacobian

_MEANING = (
    "Frequencies are those of the links on their gears while the motors stand. Deflections are how far weight, "
    "inertia and force move the tool beside a rigid arm; they are linear in the efforts."
)


@attrs.frozen(kw_only=True, eq=False)
class VibrationAssessment:
    """Frequencies, compliance and deflection of an arm along configurations.

    Attributes:
        arm: with n joints, k of them with flexible gears.
        q: (p, n) the configurations [rad] or [m].
        numbers: (p,) of each among those that were given, from 1.
        given: how many were given.
        moving: whether velocities and accelerations were given, too.
        modes: of vibration at each configuration.
        compliance: (p, 6, 6) of the tool, by force and moment along base axes.
        at_rest: (p, 3) deflection of the tool by weight, springs and force [m].
        deflection: (p, 3) the same, with the efforts of the motion.
    """

    arm: Arm
    q: Array
    numbers: Numbers
    given: int
    moving: bool
    modes: Modes
    compliance: Array
    at_rest: Array
    deflection: Array

    @property
    def stretch(self) -> Array:
        """Displacement of the tool by a unit force in the direction in which it yields most, (p,) [m/N]."""
        return np.asarray(np.linalg.eigvalsh(self.compliance[:, :3, :3])[:, -1])

    @property
    def softest(self) -> int:
        """The configuration, from 0, with the lowest frequency."""
        return int(self.modes.frequencies[:, 0].argmin())

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        notes = [_MEANING]
        rigid = np.flatnonzero(~np.isfinite(joint_stiffness(self.arm)))
        if len(rigid):
            notes.append(f"Rigid gears: {', '.join(self.arm.joint_label(int(i)) for i in rigid)}.")
        if len(self.q) < self.given:
            notes.append(f"{len(self.q)} of the {self.given} configurations are computed, evenly spread.")
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        columns = {
            "q": self.q,
            "frequencies_hz": self.modes.frequencies,
            "damping_ratios": self.modes.damping,
            "shapes": np.swapaxes(self.modes.shapes, 1, 2),
            "compliance": self.compliance,
            "deflection_at_rest_m": self.at_rest,
        } | ({"deflection_m": self.deflection} if self.moving else {})
        stiffness = [float(x) if np.isfinite(x) else None for x in self.arm.motor_values("stiffness")]
        return {
            "arm": self.arm.name,
            "stiffness": stiffness,
            "damping": self.arm.motor_values("damping").tolist(),
            "configurations": [
                {"number": int(self.numbers[p]), **{name: values[p].tolist() for name, values in columns.items()}}
                for p in range(len(self.q))
            ],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the tables: the modes, their shapes where the arm is softest, and compliance and deflection."""
        yield self._mode_table()
        yield self._shape_table()
        yield ResultTable(
            title="Tool: how far it yields",
            heads=("quantity", "least", "largest", "at"),
            rows=tuple(self._yielding()),
            numbers=(1, 2, 3),
        )

    def _mode_table(self) -> ResultTable:
        f, z = self.modes.frequencies, self.modes.damping
        rows = [
            (
                str(i + 1),
                f"{f[:, i].min():.4f}",
                f"{f[:, i].max():.4f}",
                _percent(z[:, i].min()),
                _percent(z[:, i].max()),
            )
            for i in range(f.shape[1])
        ]
        count = len(self.q)
        return ResultTable(
            title=f"{self.arm.name}: vibrations at {count} configuration{'s' if count > 1 else ''}",
            heads=("mode", "lowest Hz", "highest Hz", "least damping, %", "most, %"),
            rows=rows,
            numbers=range(5),
        )

    def _shape_table(self) -> ResultTable:
        """Return how the joints move in each mode, the farthest as 1."""
        p = self.softest
        shapes = self.modes.shapes[p]
        peaks = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None], axis=0)
        scaled = shapes / peaks
        rows = [
            (str(i + 1), f"{self.modes.frequencies[p, i]:.4f}", *(f"{x:z.3f}" for x in scaled[:, i]))
            for i in range(scaled.shape[1])
        ]
        return ResultTable(
            title=f"Shapes of the modes at configuration {self.numbers[p]}, where the lowest frequency is least",
            heads=("mode", "Hz", *(f"j{i + 1}" for i in range(self.arm.n))),
            rows=rows,
            numbers=range(2 + self.arm.n),
            remark="joints in rad or m, the farthest as 1",
        )

    def _yielding(self) -> Iterator[tuple[str, str, str, str]]:
        quantities = {
            "compliance, softest direction, mm/kN": self.stretch * 1e6,
            "deflection at rest, mm": np.linalg.norm(self.at_rest, axis=1) * 1e3,
        }
        if self.moving:
            quantities["deflection in motion, mm"] = np.linalg.norm(self.deflection, axis=1) * 1e3
        for name, values in quantities.items():
            yield name, f"{values.min():.4f}", f"{values.max():.4f}", str(self.numbers[values.argmax()])


def assess_vibration(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike | None = None,
    qdd: ArrayLike | None = None,
    *,
    force: ArrayLike = (0.0, 0.0, 0.0),
    most: int = 200,
) -> VibrationAssessment:
    """Assess the vibrations and the deflection of an arm along configurations.

    Args:
        arm: with n joints, of which some have flexible gears.
        q: (p, n) configurations of the links, or one of them [rad] or [m].
        qd: (p, n) velocities; at rest when left out.
        qdd: (p, n) accelerations, with ``qd`` only.
        force: (3,) that acts on the tool, along base axes [N].
        most: of more configurations, so many are computed, evenly spread, the first and the last included.

    Raises:
        ShapeError: arrays do not fit the arm or each other.
        TooFewError: there is no configuration.
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
    """
    every = np.atleast_2d(joint_array(q, arm.n))
    if not len(every):
        raise TooFewError("expected a configuration at least")
    rows = evenly_spread(len(every), most)
    motion = None
    if qd is not None and qdd is not None:
        speeds, accelerations = (
            np.atleast_2d(joint_array(qd, arm.n, "qd")),
            np.atleast_2d(joint_array(qdd, arm.n, "qdd")),
        )
        for name, value in (("qd", speeds), ("qdd", accelerations)):
            if value.shape != every.shape:
                raise ShapeError(f"{name}: expected shape {every.shape} as q has, got {value.shape}")
        motion = speeds[rows], accelerations[rows]
    push = floats(force, "force")
    if push.shape != (3,):
        raise ShapeError(f"force: expected shape (3,), got {push.shape}")
    configurations = every[rows]
    wrench = np.append(push, np.zeros(3))
    J = jacobian(arm, configurations)[:, :3]
    rest = deflection(arm, configurations, wrench=wrench)
    moved = rest if motion is None else deflection(arm, configurations, motion[0], motion[1], wrench)
    return VibrationAssessment(
        arm=arm,
        q=configurations,
        numbers=rows + 1,
        given=len(every),
        moving=motion is not None,
        modes=modes(arm, configurations),
        compliance=tool_compliance(arm, configurations),
        at_rest=np.einsum("pij,pj->pi", J, rest),
        deflection=np.einsum("pij,pj->pi", J, moved),
    )


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.3f}"
