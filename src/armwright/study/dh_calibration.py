"""Calibrating a three-joint arm on a board of 33 points: the thesis' experiment, simulated, and a complete model.

The thesis touches the points of a board, flat, rolled and pitched, measures them with cameras, and fits fourteen
Denavit-Hartenberg parameters within bounds of 2 mm and 2 degrees; the pose of the arm in the cameras' frame is not
fitted. The mean error over six verification points decreases from 26.850 to 16.436 mm at best. Here the same is
simulated with an arm that has such errors and a displaced base; then all identifiable parameters are fitted.
"""

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.fitting import Calibration, calibrate_points

NOISE = 0.3e-3  # of the cameras, per coordinate [m]
# Verification points, and mean errors there before and after calibration, as the thesis prints them [mm].
PRINTED_POINTS = (
    (355, -275, 50), (355, -135, 50), (495, -275, 50), (355, -415, 50), (215, -275, 50), (355, -275, 150),
)  # fmt: skip
PRINTED: Mapping[str, tuple[float, ...]] = {
    "nominal": (26.234, 26.522, 28.178, 27.651, 25.949, 26.568),
    "flat": (15.849, 17.444, 17.122, 16.329, 16.230, 15.643),
    "roll": (18.793, 15.677, 26.898, 21.531, 12.514, 19.179),
    "pitch": (22.375, 20.094, 27.686, 23.417, 16.230, 23.440),
}
ATTITUDES: Mapping[str, tuple[float, float]] = {"flat": (0.0, 0.0), "roll": (11.7, 0.0), "pitch": (0.0, 11.8)}  # deg
CENTRE = (0.355, -0.275, 0.05)
RADIUS, LINE = 0.14, 0.12  # of the board's circle, half its lines [m]
# The thesis' estimates on the flat board (table 2.3), used as the true errors; and the pose of the base [m, rad].
TRUE_LINKS: Mapping[str, float] = {
    "joint1.d": -0.5e-3, "joint1.theta": np.radians(-0.6036), "joint1.a": 0.3e-3, "joint1.alpha": np.radians(0.0783),
    "joint2.d": -0.4e-3, "joint2.theta": np.radians(0.0704), "joint2.a": 0.2e-3, "joint2.alpha": np.radians(-1.025),
    "joint3.d": -0.4e-3, "joint3.theta": np.radians(-0.132), "joint3.a": -0.1e-3, "joint3.alpha": np.radians(-0.526),
    "tool.z": 0.2e-3, "tool.x": -0.1e-3,
}  # fmt: skip
TRUE_BASE: Mapping[str, float] = {
    "base.x": 19e-3, "base.y": 21e-3, "base.z": -19e-3, "base.rx": 4e-3, "base.ry": -5e-3, "base.rz": 8e-3,
}  # fmt: skip
# The fourteen parameters that the thesis fits, and their bounds.
THESIS = (*(f"joint{i}.{key}" for i in (1, 2, 3) for key in ("d", "theta", "a", "alpha")), "tool.z", "tool.x")
BOUND_LENGTH, BOUND_ANGLE = 2e-3, np.radians(2.0)


class Row(NamedTuple):
    """Errors at the six verification points [mm].

    Attributes:
        model: the model that leads the arm.
        points: the boards to which it was fitted.
        printed: errors in the thesis; None where it has none.
        ours: errors in the simulation.
    """

    model: str
    points: str
    printed: tuple[float, ...] | None
    ours: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean error in the simulation [mm]."""
        return float(np.mean(self.ours))


class ParameterRow(NamedTuple):
    """An error of the arm [m], [rad].

    Attributes:
        name: name of the error.
        true: value of the arm that is measured.
        thesis: estimate by the thesis' fit on the flat board; None where it is not fitted.
        ours: estimate by the complete model on all boards; None where it is fixed.
        standard_error: standard error of ``ours``.
    """

    name: str
    true: float
    thesis: float | None
    ours: float | None
    standard_error: float | None


class BoardMeasurement(NamedTuple):
    """Measurements of the points of a board.

    Attributes:
        q: (33, 3) joint positions [rad].
        points: (33, 3) positions of the points by the cameras [m].
    """

    q: Array
    points: Array


@cache
def chain() -> Chain:
    """Return the thesis' arm with all its error parameters."""
    return kinematic_chain(load_arm("ntu-3r"))


def truth() -> Array:
    """Return the errors of the arm that is measured."""
    errors = {**TRUE_LINKS, **TRUE_BASE}
    return np.array([errors.get(name, 0.0) for name in chain().names])


def board(attitude: str) -> Array:
    """Return the (33, 3) points of the board in an orientation [m]: a circle of 16 and two lines that cross."""
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    line = np.linspace(-LINE, LINE, 9)
    flat = [*zip(RADIUS * np.cos(angle), RADIUS * np.sin(angle), strict=True), *((x, 0.0) for x in line)]
    flat += [(0.0, y) for y in line if abs(y) > 1e-9]
    roll, pitch = np.radians(ATTITUDES[attitude])
    Rx = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    Ry = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    return np.asarray(np.array(CENTRE) + np.array([(x, y, 0.0) for x, y in flat]) @ (Ry @ Rx).T, dtype=np.float64)


def measure_board(attitude: str, *, noise: float = NOISE, seed: int = 0) -> BoardMeasurement:
    """Return simulated measurements of the true arm touching the points of a board."""
    rng = np.random.default_rng([seed, list(ATTITUDES).index(attitude)])
    points = board(attitude)
    q = configurations(truth(), points)
    return BoardMeasurement(q, points + noise * rng.standard_normal(points.shape))


def configurations(errors: Array, points: Array) -> Array:
    """Return (m, 3) joint positions at which an arm with these errors has its tool at points (m, 3)."""
    solutions, guess = [], _START
    for point in points:

        def residual(q: Array, point: Array = point) -> Array:
            return np.asarray(chain().forward(q, errors).position[0] - point, dtype=np.float64)

        guess = least_squares(residual, guess, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        solutions.append(guess)
    return np.array(solutions)


# A configuration over the board [rad].
_START = np.array([-0.65, 0.2, 0.4])


def thesis_fit(data: BoardMeasurement) -> Array:
    """Return the errors by the thesis' fit: fourteen parameters in bounds that minimize the sum of the distances."""
    names, lengths = chain().names, chain().is_length
    fitted = [names.index(name) for name in THESIS]
    bound = np.where(lengths[fitted], BOUND_LENGTH, BOUND_ANGLE)
    errors = np.zeros(len(names))

    def total(x: Array) -> tuple[float, Array]:
        errors[fitted] = x * bound
        reached = chain().forward(data.q, errors)
        residual = reached.position - data.points
        size = np.linalg.norm(residual, axis=1)
        direction = residual / np.maximum(size, 1e-12)[:, None]
        slope = np.einsum("mi,mik->k", direction, reached.position_jacobian)[fitted] * bound
        return float(size.sum() * 1e3), slope * 1e3

    start, bounds = np.zeros(len(fitted)), [(-1.0, 1.0)] * len(fitted)
    result = minimize(total, start, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": 3000})
    errors[fitted] = result.x * bound
    return errors


@cache
def full_fit(attitudes: tuple[str, ...]) -> Calibration:
    """Return a calibration of all errors that are identifiable by boards in these orientations."""
    q, points = map(np.concatenate, zip(*map(measure_board, attitudes), strict=True))
    return calibrate_points(chain().arm, q, points, base=np.eye(4))


def verification_errors(errors: Array) -> tuple[float, ...]:
    """Return the errors of the true arm at the six verification points, led by a model with these errors [mm]."""
    points = np.array(PRINTED_POINTS) / 1e3
    reached = chain().forward(configurations(errors, points), truth()).position
    return tuple(float(x) * 1e3 for x in np.linalg.norm(reached - points, axis=1))


def verification_table() -> list[Row]:
    """Return table 2.4, with the errors of the complete model at the same points."""
    rows = [Row("nominal", "none", PRINTED["nominal"], verification_errors(np.zeros(len(chain().names))))]
    fits = {name: thesis_fit(measure_board(name)) for name in ATTITUDES}
    rows += [Row("thesis", name, PRINTED[name], verification_errors(errors)) for name, errors in fits.items()]
    rows += [Row("complete", name, None, verification_errors(full_fit((name,)).errors)) for name in ATTITUDES]
    rows.append(Row("complete", "all three", None, verification_errors(full_fit(tuple(ATTITUDES)).errors)))
    return rows


def parameter_table() -> list[ParameterRow]:
    """Return the errors of the arm: true values and both estimates."""
    ours = full_fit(tuple(ATTITUDES))
    thesis = thesis_fit(measure_board("flat"))
    estimates = dict(zip(ours.names, zip(ours.values, ours.standard_errors, strict=True), strict=True))
    table = []
    for i, name in enumerate(chain().names):
        value, error = estimates.get(name, (None, None))
        if truth()[i] or value is not None:
            fitted = float(thesis[i]) if name in THESIS else None
            table.append(ParameterRow(name, float(truth()[i]), fitted, value, error))
    return table
