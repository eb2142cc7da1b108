"""How far the tool of an arm yields at rest along a program, which joint yields most, and how to correct it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.dynamics.static_deflection import (
    CompensatedPositions,
    StaticDeflection,
    compensated_positions,
    static_deflection,
)
from armwright.errors import TooFewError
from armwright.files.result_table import ResultTable

# A goal that is missed by more was not reached [m].
_REACHED = 1e-6


@attrs.frozen(kw_only=True, eq=False)
class DeflectionAssessment:
    """The static deflection of an arm in m configurations.

    Attributes:
        arm: with n joints.
        q: (m, n) joint positions of the motors [rad] or [m].
        compliance: (n, 3) of its joints about x, y and z [rad/(N m)], [m/N].
        deflection: in these configurations.
        compensated: joint positions with which the tool comes where it is in the rigid arm.
    """

    arm: Arm
    q: Array
    compliance: Array
    deflection: StaticDeflection
    compensated: CompensatedPositions

    @property
    def lengths(self) -> Array:
        """(m,) how far the tool is displaced [m]."""
        return np.asarray(np.linalg.norm(self.deflection.displacement, axis=1), dtype=np.float64)

    @property
    def worst_row(self) -> int:
        """The configuration, from 0, with the largest displacement."""
        return int(self.lengths.argmax())

    @property
    def most_yielding_joint(self) -> int:
        """The joint, from 0, with the largest share of the displacement there."""
        return int(self.deflection.shares[self.worst_row].argmax())

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know beside the numbers."""
        rigid = [self.arm.joint_label(i) for i in range(self.arm.n) if not self.compliance[i].any()]
        notes = [f"Rigid, for no stiffness is given: {', '.join(rigid)}."] if rigid else []
        missed = int((self.compensated.residual > _REACHED).sum())
        if missed:
            notes.append(
                f"In {missed} of {len(self.q)} configurations no correction nearby brings the tool where the rigid arm "
                f"has it: it misses by up to {self.compensated.residual.max() * 1e3:.3g} mm."
            )
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return the assessment as plain data in SI units."""
        at_rest, lengths = self.deflection, self.lengths
        return {
            "arm": self.arm.name,
            "compliance": self.compliance.tolist(),
            "worst_row": self.worst_row + 1,
            "most_yielding_joint": self.most_yielding_joint + 1,
            "rows": [
                {
                    "q": self.q[k].tolist(),
                    "displacement_m": at_rest.displacement[k].tolist(),
                    "length_m": float(lengths[k]),
                    "shares_m": at_rest.shares[k].tolist(),
                    "joints": at_rest.joints[k].tolist(),
                    "loads": at_rest.loads[k].tolist(),
                    "compensated_q": self.compensated.q[k].tolist(),
                    "residual_m": float(self.compensated.residual[k]),
                }
                for k in range(len(self.q))
            ],
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the tables: the tool, then the joints where it is displaced most."""
        k, lengths = self.worst_row, self.lengths
        x, y, z = self.deflection.displacement[k] * 1e3
        yield ResultTable(
            title=f"{self.arm.name}: displacement of the tool in {len(self.q)} configuration{'s'[: len(self.q) > 1]}",
            heads=("quantity", "value"),
            rows=[
                ("mean, mm", f"{lengths.mean() * 1e3:.4f}"),
                ("largest, mm", f"{lengths.max() * 1e3:.4f}"),
                ("in row", str(k + 1)),
                ("there along x, y, z, mm", f"{x:z.4f}, {y:z.4f}, {z:z.4f}"),
                ("joint that yields most", self.arm.joint_label(self.most_yielding_joint)),
            ],
            numbers=(1,),
        )
        yield ResultTable(
            title=f"Joints in row {k + 1}, by their part of the displacement",
            heads=("joint", "part mm", "about x mrad", "about y mrad", "own axis", "", "load"),
            rows=[self._row(k, int(i)) for i in np.argsort(-self.deflection.shares[k], kind="stable")],
            numbers=(1, 2, 3, 4, 6),
        )

    def _row(self, row: int, joint: int) -> tuple[str, ...]:
        x, y, z = self.deflection.joints[row, joint] * 1e3
        units = self.arm.joints[joint].units
        load = f"{self.deflection.loads[row, joint, 2]:z.3f} {units.effort}"
        part = f"{self.deflection.shares[row, joint] * 1e3:z.4f}"
        return self.arm.joint_label(joint), part, f"{x:z.4f}", f"{y:z.4f}", f"{z:z.4f}", f"m{units.position}", load


def assess_deflection(
    arm: Arm,
    compliance: ArrayLike,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
) -> DeflectionAssessment:
    """Assess how far the tool of an arm yields in configurations of a program, at rest.

    Args:
        arm: with n joints.
        compliance: (n, 3) of its joints about x, y and z, see ``static_deflection`` [rad/(N m)], [m/N].
        q: (m, n) joint positions [rad] or [m].
        payload: (4,) or (m, 4) mass and centre of mass in the frame of the tool [kg], [m].
        wrench: (6,) or (m, 6) force and moment on the tool, along the axes of the base [N], [N m].

    Raises:
        ShapeError: see ``static_deflection``.
        InvalidValueError: see ``static_deflection``.
        TooFewError: there is no configuration.
    """
    configurations = np.atleast_2d(joint_array(q, arm.n))
    if not len(configurations):
        raise TooFewError("expected a configuration at least")
    return DeflectionAssessment(
        arm=arm,
        q=configurations,
        compliance=np.asarray(compliance, dtype=np.float64),
        deflection=static_deflection(arm, compliance, configurations, payload=payload, wrench=wrench),
        compensated=compensated_positions(arm, compliance, configurations, payload=payload, wrench=wrench),
    )
