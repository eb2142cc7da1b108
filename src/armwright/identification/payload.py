"""A load on a known arm: its mass, centre and inertia, from the efforts that it adds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm, Link
from armwright.arrays import Array, ArrayLike, read_only
from armwright.compiled.arm import compile_arm
from armwright.dynamics.bodies import Body, in_previous_frame
from armwright.dynamics.identification import independent_columns
from armwright.dynamics.payloads import payload
from armwright.dynamics.regressors import OF_LINK
from armwright.errors import ContradictionError, UnsupportedArmError
from armwright.files.result_table import ResultTable
from armwright.identification.checks import log_warnings, refuse_other_units, refuse_swapped
from armwright.identification.equations import equations
from armwright.identification.feasible import Measured, ball, link_of, possible_bodies
from armwright.identification.fitting import Fit, robust, summed
from armwright.identification.log import Log
from armwright.identification.model import DynamicModel
from armwright.identification.signals import Preparation, motions, preparation_of

# What friction of a joint may have changed by with the load and since the arm was identified.
_CHANGED = ("viscous", "coulomb", "offset")
# The ball that a load is likened to weighs as little as this in squared standard deviations: it only keeps it possible.
_WEIGHT = 1e-2
# States that show what motions tell.
_STATES = 50
_PARAMETERS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@attrs.frozen(kw_only=True, eq=False)
class Payload:
    """A load that was identified.

    Attributes:
        arm: the arm without it.
        load: its body, in the tool frame.
        fit: of its ten parameters about the tool point, then of what friction has changed by.
        changes: (n, 3) by how much viscous, Coulomb friction and offset of the joints differ from the arm's.
        notes: what a reader must know.
    """

    arm: Arm
    load: Link
    fit: Fit
    changes: Array = attrs.field(converter=read_only)
    notes: tuple[str, ...] = ()

    @property
    def loaded(self) -> Arm:
        """The arm with the load."""
        return payload(self.arm, self.load.mass, self.load.com, self.load.inertia)

    @property
    def mass_error(self) -> float:
        """Standard error of the mass [kg]."""
        return float(self.fit.errors[0])

    @property
    def com_errors(self) -> Array:
        """(3,) standard errors of the centre of mass [m]."""
        m, C = self.load.mass, self.fit.covariance[:4, :4]
        J = np.hstack([-self.load.com[:, None] / m, np.eye(3) / m])
        return np.asarray(np.sqrt((J @ C @ J.T).diagonal()))

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        return {
            "arm": self.arm.name,
            "mass": self.load.mass,
            "mass_error": self.mass_error,
            "com": self.load.com.tolist(),
            "com_errors": self.com_errors.tolist(),
            "inertia": self.load.inertia.tolist(),
            "parameters": dict(zip(_PARAMETERS, self.fit.values[:OF_LINK].tolist(), strict=True)),
            "errors": dict(zip(_PARAMETERS, self.fit.errors[:OF_LINK].tolist(), strict=True)),
            "friction_changes": self.changes.tolist(),
            "notes": list(self.notes),
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the load, then what friction has changed by."""
        load, inertia = self.load, self.load.inertia
        rows = [("mass", f"{load.mass:.4f}", f"{self.mass_error:.4f}", "kg")]
        centre = zip("xyz", load.com * 1e3, self.com_errors * 1e3, strict=True)
        rows += [(f"centre {axis}", f"{x:z.2f}", f"{error:.2f}", "mm") for axis, x, error in centre]
        errors = self.fit.errors[4:OF_LINK]
        rows += [
            (name, f"{inertia[pair]:z.5f}", f"{error:.5f}", "kg m²")
            for name, pair, error in zip(_PARAMETERS[4:], _PAIRS, errors, strict=True)
        ]
        yield ResultTable(
            title="Load in the tool frame, inertia about its centre",
            heads=("", "value", "±", "unit"),
            rows=rows,
            numbers=(1, 2),
        )
        yield ResultTable(
            title="Friction, beyond that of the arm file",
            heads=("joint", *_CHANGED),
            rows=[(str(i), *(f"{x:+z.3g}" for x in row)) for i, row in enumerate(self.changes, 1)],
            numbers=(1, 2, 3),
        )


@attrs.frozen(kw_only=True, eq=False, slots=False)
class LoadedModel:
    """The model of an arm and of a load on its tool.

    Attributes:
        model: of the arm.
        loaded: whether the load is there; without it its columns are 0.
        of_arm: names of the base parameters of the arm that have columns, before the ten of the load.
    """

    model: DynamicModel
    loaded: bool = True
    of_arm: tuple[str, ...]

    @cached_property
    def _of_tool(self) -> Array:
        """The parameters (10, 10) of the last link by those of a body in the tool frame."""
        R, p = self.model.arm.tool[:3, :3].tolist(), self.model.arm.tool[:3, 3].tolist()
        columns = []
        for m, x, y, z, xx, xy, xz, yy, yz, zz in np.eye(OF_LINK).tolist():
            body = in_previous_frame(Body(m, [x, y, z], [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), R, p)
            columns.append([body.mass, *body.moment, *(body.tensor[a][b] for a, b in _PAIRS)])
        return np.array(columns).T

    def base_columns(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Return the columns (k, n, b + 10) of the arm and the load."""
        Y, n = self.model.columns(q, qd, qdd), self.model.arm.n
        own = Y[:, :, [self.model.names.index(name) for name in self.of_arm]]
        load = Y[:, :, OF_LINK * (n - 1) : OF_LINK * n] @ self._of_tool
        return np.concatenate([own, load * self.loaded], axis=2)


def identify_payload(arm: Arm, logs: Sequence[Log], preparation: Preparation | None = None) -> Payload:
    """Identify the load on the tool of a known arm.

    Friction may have changed with load and temperature: viscous and Coulomb friction and the offset of each joint are
    fitted beside the load.

    Args:
        arm: the arm without the load, as identified, with n joints.
        logs: of its motions with the load.
        preparation: of motions; by the logs when left out.

    Raises:
        InvalidValueError: a log is of another arm, or in other units.
        FileFormatError: positions look like degrees.
        MissingExtraError: Clarabel is not installed.
        TooFewError: too little motion is left.
        UnsupportedArmError: no motion of the arm tells all of a load.
        ContradictionError: the efforts ask for a load of less than nothing, or those of joints are swapped or reversed.
    """
    n = arm.n
    model = DynamicModel(arm=arm, terms=_CHANGED)
    changes = tuple(f"{term}{i}" for i in range(1, n + 1) for term in _CHANGED)
    loaded = LoadedModel(model=model, of_arm=changes)
    _refuse_hidden(loaded)
    refuse_other_units(arm, logs)
    logs = [log.without_spikes() for log in logs]
    notes = tuple(log_warnings(arm, logs))
    logs = [log.moving() for log in logs]
    preparation = preparation or preparation_of(logs)
    whole = DynamicModel(arm=arm)
    refuse_swapped(whole, list(equations(whole, motions(logs, preparation), preparation.decimation)))
    without = compile_arm(arm).inverse_dynamics
    residuals = [
        motion._replace(tau=motion.tau - without(motion.q, motion.qd, motion.qdd))
        for motion in motions(logs, preparation)
    ]
    # The load comes first.
    blocks = [
        block._replace(columns=np.roll(block.columns, OF_LINK, axis=2))
        for block in equations(loaded, residuals, preparation.decimation)
    ]
    fit = robust(blocks)
    mass, error = float(fit.values[0]), float(fit.errors[0])
    if mass < 3 * error:
        raise ContradictionError(
            f"no load is seen: its mass comes out as {mass:.3g} ± {error:.2g} kg; is it there, and are the gains right?"
        )
    body = Measured(combinations=np.eye(len(fit.values)), sums=summed(blocks, fit), sigma=fit.sigma)
    values, _ = possible_bodies(body, [ball(mass)], [], weight=_WEIGHT)
    changed = values[OF_LINK:].reshape(n, len(_CHANGED))
    return Payload(arm=arm, load=link_of(values[:OF_LINK]), fit=fit, changes=changed, notes=notes)


def _refuse_hidden(loaded: LoadedModel) -> None:
    """Refuse an arm whose motions cannot tell a load.

    Raises:
        UnsupportedArmError: a parameter of the load has no effect, or that of others.
    """
    n = loaded.model.arm.n
    q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, size=(3, _STATES, n))
    columns, _ = independent_columns(
        loaded.base_columns(q, qd, qdd)[:, :, -OF_LINK:].reshape(-1, OF_LINK), range(OF_LINK)
    )
    hidden = [name for k, name in enumerate(_PARAMETERS) if k not in columns]
    if hidden:
        raise UnsupportedArmError(
            f"arm '{loaded.model.arm.name}': its motions do not tell {', '.join(hidden)} of a load apart from the rest"
        )
