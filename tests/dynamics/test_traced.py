"""The equations of this folder leave graphs that compute what the equations compute."""

from collections.abc import Callable

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.dynamics.articulated_body import articulated_body
from armwright.dynamics.energy import link_kinetic_energy, link_potential_energy
from armwright.dynamics.inertia_matrix import composite_rigid_body
from armwright.dynamics.joint_frames import Rotation
from armwright.dynamics.lagrange_euler import lagrange_euler
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.shares import gravity_shares, speed_shares
from armwright.tracing.graph import Graph, Traced, operation_count
from armwright.tracing.scalar import Scalar
from oracles.arms import random_arm
from oracles.graphs import evaluate

ROUNDING = 1e-9  # relative to the largest number: a graph adds in its own order

Equation = Callable[[Arm, list[Scalar], list[Scalar], list[Scalar]], list[Scalar]]

EQUATIONS: dict[str, Equation] = {
    "newton_euler": newton_euler,
    "mass matrix": lambda arm, q, _qd, _x: [entry for row in composite_rigid_body(arm, q) for entry in row],
    "articulated_body": lambda arm, q, qd, tau: articulated_body(arm, q, qd, tau)[0],
    "gravity": lambda arm, q, _qd, _x: gravity_shares(arm, q),
    "speeds": lambda arm, q, qd, _x: speed_shares(arm, q, qd),
    "lagrange_euler": lagrange_euler,
    "energy": lambda arm, q, qd, _x: [link_kinetic_energy(arm, q, qd), link_potential_energy(arm, q)],
}


def _traced(equation: Equation, arm: Arm) -> tuple[Graph, list[int]]:
    graph = Graph()
    outputs = equation(arm, graph.inputs(arm.n), graph.inputs(arm.n), graph.inputs(arm.n))
    return graph, [x.node if isinstance(x, Traced) else graph.constant(float(x)) for x in outputs]


@pytest.mark.parametrize("name", EQUATIONS)
def test_graph_against_floats(name: str, rng: np.random.Generator) -> None:
    """A graph gives what its equation gives over floats, on a skew arm and on one whose zeros have been folded."""
    for arm in (random_arm(rng, 4), load_arm("stanford-jpl")):
        graph, outputs = _traced(EQUATIONS[name], arm)
        numbers = rng.normal(size=(3, arm.n))

        expected = np.array(EQUATIONS[name](arm, *numbers.tolist()))

        values = evaluate(graph, outputs, numbers.ravel().tolist())
        np.testing.assert_allclose(values, expected, rtol=0, atol=ROUNDING * max(1.0, np.abs(expected).max()))


def test_articulated_bodies_grow_with_the_joints() -> None:
    """Twice the joints take about twice the operations; the composite bodies' mass matrix takes more than that."""
    rng = np.random.default_rng(1)
    long = random_arm(rng, 16)

    def count(name: str, joints: int) -> int:
        short = Arm(name="part", joints=long.joints[:joints], links=long.links[:joints], motors=long.motors[:joints])
        return sum(operation_count(*_traced(EQUATIONS[name], short)).values())

    assert count("articulated_body", 16) < 2.4 * count("articulated_body", 8)
    assert count("newton_euler", 16) < 2.4 * count("newton_euler", 8)
    assert count("mass matrix", 16) > 2.4 * count("mass matrix", 8)


def test_a_quarter_turn_keeps_all_digits() -> None:
    """Axes that change places change the places of a tensor's numbers; none is added to a larger one."""
    A = [[1.0, 2e-20, 3e-20], [4e-20, 5e-20, 6e-20], [7e-20, 8e-20, 9e-20]]
    turns = {
        True: np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
        False: np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    }

    for about_x, R in turns.items():
        found = Rotation(about_x=about_x, cosine=0.0, sine=1.0).outward_matrix(A)

        assert np.array_equal(found, R @ np.array(A) @ R.T)
