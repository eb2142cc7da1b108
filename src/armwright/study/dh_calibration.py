"""Calibrating a three-joint arm on a board of 33 points: the thesis' experiment, simulated, and a complete model.

The thesis touches the points of a board, flat, rolled and pitched, measures them with cameras, and fits fourteen
Denavit-Hartenberg numbers inside bounds of 2 mm and 2 degrees; where the arm stands in the cameras' frame is not
fitted. Its mean error over six verification points falls from 26.850 to 16.436 mm at best. Here an arm with errors
like those it found, standing a little beside where it should, does the same; then all that the points tell is fitted.
"""

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import attrs
import numpy as np
from scipy.optimize import least_squares, minimize

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, chain_of
from armwright.calibration.fitting import Calibration, calibrate_points

NOISE = 0.3e-3  # of the cameras, per coordinate [m]
# Places to verify at, mean errors there before and after, as the thesis prints them [mm].
PRINTED_POINTS = (
    (355, -275, 50), (355, -135, 50), (495, -275, 50), (355, -415, 50), (215, -275, 50), (355, -275, 150),
)  # fmt: skip
PRINTED: Mapping[str, tuple[float, ...]] = {
    "as said": (26.234, 26.522, 28.178, 27.651, 25.949, 26.568),
    "flat": (15.849, 17.444, 17.122, 16.329, 16.230, 15.643),
    "roll": (18.793, 15.677, 26.898, 21.531, 12.514, 19.179),
    "pitch": (22.375, 20.094, 27.686, 23.417, 16.230, 23.440),
}
ATTITUDES: Mapping[str, tuple[float, float]] = {"flat": (0.0, 0.0), "roll": (11.7, 0.0), "pitch": (0.0, 11.8)}  # deg
CENTRE = (0.355, -0.275, 0.05)
RADIUS, LINE = 0.14, 0.12  # of the board's circle, half its lines [m]
# What the thesis found on the flat board (table 2.3), taken for the truth; and where the arm stands [m, rad].
TRUE_LINKS: Mapping[str, float] = {
    "joint1.d": -0.5e-3, "joint1.theta": np.radians(-0.6036), "joint1.a": 0.3e-3, "joint1.alpha": np.radians(0.0783),
    "joint2.d": -0.4e-3, "joint2.theta": np.radians(0.0704), "joint2.a": 0.2e-3, "joint2.alpha": np.radians(-1.025),
    "joint3.d": -0.4e-3, "joint3.theta": np.radians(-0.132), "joint3.a": -0.1e-3, "joint3.alpha": np.radians(-0.526),
    "tool.z": 0.2e-3, "tool.x": -0.1e-3,
}  # fmt: skip
TRUE_BASE: Mapping[str, float] = {
    "base.x": 19e-3, "base.y": 21e-3, "base.z": -19e-3, "base.rx": 4e-3, "base.ry": -5e-3, "base.rz": 8e-3,
}  # fmt: skip
# The fourteen numbers that the thesis fits, and their bounds.
THESIS = (*(f"joint{i}.{key}" for i in (1, 2, 3) for key in ("d", "theta", "a", "alpha")), "tool.z", "tool.x")
BOUND_LENGTH, BOUND_ANGLE = 2e-3, np.radians(2.0)


class Row(NamedTuple):
    """Errors at the six verification points [mm].

    Attributes:
        model: whose.
        points: which points it was fitted to.
        printed: of the thesis; None where it has none.
        ours: of the simulation.
    """

    model: str
    points: str
    printed: tuple[float, ...] | None
    ours: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean of ours [mm]."""
        return float(np.mean(self.ours))


class ParameterRow(NamedTuple):
    """An error of the arm [m], [rad].

    Attributes:
        name: of the error.
        true: of the arm that is measured.
        thesis: as the thesis fits it on the flat board; None where it does not.
        ours: by the complete model on all boards; None where it is fixed.
        standard_error: of ours.
    """

    name: str
    true: float
    thesis: float | None
    ours: float | None
    standard_error: float | None


@attrs.frozen(kw_only=True, eq=False)
class Touched:
    """A board touched point by point.

    Attributes:
        q: (33, 3) joint positions [rad].
        points: (33, 3) where the cameras saw the points [m].
    """

    q: Array
    points: Array


@cache
def chain() -> Chain:
    """Return the thesis' arm with all errors that it can have."""
    return chain_of(load_arm("ntu-3r"))


def truth() -> Array:
    """Return the errors of the arm that is measured."""
    given = {**TRUE_LINKS, **TRUE_BASE}
    return np.array([given.get(name, 0.0) for name in chain().names])


def board(attitude: str) -> Array:
    """Return (33, 3) the points of the board in an attitude [m]: a circle of 16 and two lines that cross."""
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    line = np.linspace(-LINE, LINE, 9)
    flat = [*zip(RADIUS * np.cos(turn), RADIUS * np.sin(turn), strict=True), *((x, 0.0) for x in line)]
    flat += [(0.0, y) for y in line if abs(y) > 1e-9]
    roll, pitch = np.radians(ATTITUDES[attitude])
    Rx = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    Ry = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    return np.asarray(np.array(CENTRE) + np.array([(x, y, 0.0) for x, y in flat]) @ (Ry @ Rx).T, dtype=np.float64)


def touched(attitude: str, *, noise: float = NOISE, seed: int = 0) -> Touched:
    """Return what is read when the true arm touches the points of a board."""
    rng = np.random.default_rng([seed, list(ATTITUDES).index(attitude)])
    points = board(attitude)
    q = configurations(truth(), points)
    return Touched(q=q, points=points + noise * rng.standard_normal(points.shape))


def configurations(errors: Array, points: Array) -> Array:
    """Return (m, 3) joint positions at which an arm with these errors has its tool at points (m, 3)."""
    found, guess = [], _START
    for point in points:

        def missing(q: Array, point: Array = point) -> Array:
            return np.asarray(chain().forward(q, errors).position[0] - point, dtype=np.float64)

        guess = least_squares(missing, guess, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        found.append(guess)
    return np.array(found)


# A configuration over the board [rad].
_START = np.array([-0.65, 0.2, 0.4])


def thesis_fit(data: Touched) -> Array:
    """Return errors as the thesis fits them: fourteen numbers in bounds, the sum of the distances least."""
    names, lengths = chain().names, chain().is_length
    kept = [names.index(name) for name in THESIS]
    bound = np.where(lengths[kept], BOUND_LENGTH, BOUND_ANGLE)
    errors = np.zeros(len(names))

    def total(x: Array) -> tuple[float, Array]:
        errors[kept] = x * bound
        reached = chain().forward(data.q, errors)
        off = reached.position - data.points
        size = np.linalg.norm(off, axis=1)
        slope = np.einsum("mi,mik->k", off / np.maximum(size, 1e-12)[:, None], reached.position_jacobian)[kept] * bound
        return float(size.sum() * 1e3), slope * 1e3

    start, bounds = np.zeros(len(kept)), [(-1.0, 1.0)] * len(kept)
    found = minimize(total, start, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": 3000})
    errors[kept] = found.x * bound
    return errors


def full_fit(attitudes: tuple[str, ...]) -> Calibration:
    """Return a calibration with all errors that boards in these attitudes tell."""
    data = [touched(one) for one in attitudes]
    q, points = (np.concatenate([getattr(one, key) for one in data]) for key in ("q", "points"))
    return calibrate_points(chain().arm, q, points, base=np.eye(4))


def verified(errors: Array) -> tuple[float, ...]:
    """Return how far the true arm is from six places when it is led by a model with these errors [mm]."""
    places = np.array(PRINTED_POINTS) / 1e3
    reached = chain().forward(configurations(errors, places), truth()).position
    return tuple(float(x) * 1e3 for x in np.linalg.norm(reached - places, axis=1))


def verification_table() -> list[Row]:
    """Return table 2.4, and beside it what the complete model reaches on the same points."""
    rows = [Row("as said", "none", PRINTED["as said"], verified(np.zeros(len(chain().names))))]
    rows += [Row("thesis", one, PRINTED[one], verified(thesis_fit(touched(one)))) for one in ATTITUDES]
    rows += [Row("complete", one, None, verified(full_fit((one,)).errors)) for one in ATTITUDES]
    rows.append(Row("complete", "all three", None, verified(full_fit(tuple(ATTITUDES)).errors)))
    return rows


def parameter_table() -> list[ParameterRow]:
    """Return the errors of the arm, printed beside computed."""
    ours = full_fit(tuple(ATTITUDES))
    thesis = thesis_fit(touched("flat"))
    found = dict(zip(ours.names, zip(ours.values, ours.standard_errors, strict=True), strict=True))
    table = []
    for i, name in enumerate(chain().names):
        value, error = found.get(name, (None, None))
        if truth()[i] or value is not None:
            table.append(
                ParameterRow(name, float(truth()[i]), float(thesis[i]) if name in THESIS else None, value, error)
            )
    return table
