"""A new knot of a running motion of six joints, beside SciPy's spline fitted again and Ruckig's steps."""

from measure import in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

from collections.abc import Callable
from itertools import cycle

import numpy as np
import ruckig
from numba import njit
from scipy.interpolate import CubicSpline

from armwright.motion.xspline_online import begin, xspline_kernel
from armwright.motion.xspline_path import xspline

JOINTS = 6
STEP = 0.02  # between knots [s]
KNOTS = 100_000
SIZES = (30, 100, 1000, 10_000)
CALLS = 2000


def walk(count: int) -> np.ndarray:
    """Return knots of a motion that wanders smoothly."""
    t = STEP * np.arange(count)[:, None]
    phase = np.random.default_rng(0).uniform(0, 2 * np.pi, size=(2, JOINTS))
    return np.sin(0.7 * t + phase[0]) + 0.3 * np.sin(2.9 * t + phase[1])


def planner(knots: np.ndarray) -> Callable[[], object]:
    """Return what plans all knots, one after the other, in a compiled loop; it has been compared with the whole."""
    single = xspline_kernel(JOINTS).single
    state, step = begin(knots[0], knots[1], STEP), np.array([STEP])
    segments = np.empty((len(knots) - 2, 4, JOINTS))

    @njit
    def plan(state: np.ndarray, knots: np.ndarray, segments: np.ndarray, step: np.ndarray) -> int:
        lost = 0
        for i in range(len(segments)):
            lost += single(state, knots[i + 2], step, state, segments[i])
        return lost

    if plan(state.copy(), knots, segments, step):
        raise SystemExit("the planner refused a knot")
    whole = xspline(STEP * np.arange(len(knots)), knots).coefficients[:-1]
    # Times that add up to half an hour have fewer digits for a step than the step itself.
    np.testing.assert_allclose(segments, whole, atol=1e-5 * np.abs(whole).max())
    return lambda: plan(state.copy(), knots, segments, step)


def new_targets(knots: np.ndarray) -> tuple[Callable[[], object], Callable[[], object]]:
    """Return Ruckig's step to a new target, and its step to the one that it had."""
    generator = ruckig.Ruckig(JOINTS, STEP)
    request, answer = ruckig.InputParameter(JOINTS), ruckig.OutputParameter(JOINTS)
    request.current_position = knots[0].tolist()
    request.max_velocity, request.max_acceleration, request.max_jerk = [3.0] * JOINTS, [10.0] * JOINTS, [100.0] * JOINTS
    targets = cycle([row.tolist() for row in knots[:CALLS]])

    def step() -> None:
        if generator.update(request, answer) not in {ruckig.Result.Working, ruckig.Result.Finished}:
            raise SystemExit("Ruckig refused a step")
        answer.pass_to_input(request)

    def to_new_target() -> None:
        request.target_position = next(targets)
        step()

    return to_new_target, step


def main() -> None:
    """Measure and print."""
    knots = walk(KNOTS)
    t = STEP * np.arange(KNOTS)
    plan = planner(knots)
    push, state, step = xspline_kernel(JOINTS).function("push"), begin(knots[0], knots[1], STEP), np.array([STEP])
    to_new_target, same_target = new_targets(knots)
    works: list[tuple[str, str, Callable[[], object], int]] = [
        ("armwright, pushed from Python", "any", lambda: push(state, knots[2], step), CALLS),
        *(
            (
                "SciPy, `CubicSpline` fitted again",
                f"{size}",
                lambda size=size: CubicSpline(t[:size], knots[:size], bc_type="clamped"),
                max(5, 20_000 // size),
            )
            for size in SIZES
        ),
        ("Ruckig, `update` to a new target", "", to_new_target, CALLS),
        ("Ruckig, `update` without one", "", same_target, CALLS),
    ]
    rows = []
    for who, size, work, calls in works:
        progress(f"{who} {size}")

        def repeated(work: Callable[[], object] = work, calls: int = calls) -> None:
            for _ in range(calls):
                work()

        peer, own = in_turn(repeated, plan)
        peer, own = peer / calls, own / (KNOTS - 2)
        rows.append([who, size, microseconds(peer), f"{1 / peer:.3g}", microseconds(own), f"{peer / own:.0f}"])
    section(
        "A new knot",
        f"Six joints, steps of {STEP * 1e3:g} ms. The X-spline settles the segment before the new knot and forgets "
        "what was before; a compiled loop pushes the knots. SciPy's spline is fitted to all knots again: its "
        "acceleration is continuous, and each of its segments changes with each knot. Ruckig, called from Python, does "
        "another thing: it keeps limits of speed, acceleration and jerk on the way to a target at rest.",
        table(
            [
                "beside",
                "knots so far",
                "it, µs per knot",
                "it, knots per second",
                "compiled loop, µs per knot",
                "ratio",
            ],
            rows,
        ),
    )


if __name__ == "__main__":
    main()
