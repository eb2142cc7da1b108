"""Arms whose quantities are compiled."""

import inspect
import math
import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import attrs
import numpy as np
import pytest
from numba import njit

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm, can_be_compiled, compile_arm, planning_arm
from armwright.compiled.quantities import emit_quantity, quantity_names
from armwright.dynamics.accelerations import forward_dynamics
from armwright.dynamics.derivatives import forward_dynamics_derivatives, inverse_dynamics_derivatives
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.identification import base_regressor
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import regressor
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from armwright.errors import CompilerWarning, InvalidValueError, ShapeError, UnknownNameError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
from armwright.kinematics.jacobians import jacobian
from armwright.tracing.image import CAN_BE_LINKED, can_be_placed
from oracles.arms import random_arm, random_configurations
from samples import WHOLE, Sample

ROUNDING = 1e-11  # two orders of the same sums, and sines that differ by two units in the last place


def _with_wrench(arm: Arm, q: Array, qd: Array, qdd: Array, wrench: Array) -> Array:
    return inverse_dynamics(arm, q, qd, qdd, wrench=wrench)


def _pose_and_jacobian(arm: Arm, q: Array) -> tuple[Array, Array]:
    return forward(arm, q), jacobian(arm, q)


def _mass_and_bias(arm: Arm, q: Array, qd: Array) -> tuple[Array, Array]:
    return mass_matrix(arm, q), inverse_dynamics(arm, q, qd, np.zeros_like(q), drives=False)


PLAIN: dict[str, Callable[..., Any]] = {
    "forward": forward,
    "link_poses": link_poses,
    "jacobian": jacobian,
    "pose_and_jacobian": _pose_and_jacobian,
    "inverse_dynamics": inverse_dynamics,
    "inverse_dynamics_with_wrench": _with_wrench,
    "forward_dynamics": forward_dynamics,
    "mass_matrix": mass_matrix,
    "mass_and_bias": _mass_and_bias,
    "tool_jacobian": lambda arm, q: jacobian(arm, q, "tool"),
    "bias": lambda arm, q, qd: inverse_dynamics(arm, q, qd, np.zeros_like(q), drives=False),
    "gravity_efforts": gravity_efforts,
    "coriolis_efforts": coriolis_efforts,
    "kinetic_energy": kinetic_energy,
    "potential_energy": potential_energy,
    "inverse_dynamics_derivatives": inverse_dynamics_derivatives,
    "forward_dynamics_derivatives": forward_dynamics_derivatives,
    "regressor": regressor,
    "base_regressor": base_regressor,
}


def _inputs(fast: CompiledArm, name: str, rng: np.random.Generator, lead: tuple[int, ...]) -> list[Array]:
    """Return random inputs of a quantity."""
    shapes = fast.kernel(name).emitted.inputs
    positions = random_configurations(fast.arm, rng, int(np.prod(lead))).reshape(*lead, fast.arm.n)
    return [positions if key == "q" else rng.normal(size=(*lead, *shape)) for key, shape in shapes.items()]


def _all(values: Any) -> tuple[Array, ...]:
    return values if isinstance(values, tuple) else (values,)


@pytest.mark.parametrize("name", PLAIN)
@pytest.mark.drawn(0.34)
def test_agrees_with_the_plain_function(name: str, sample: Sample) -> None:
    """A compiled quantity has the values and shapes of the plain function, for many configurations and for one."""
    rng = np.random.default_rng(sample.seed)
    # To compile a long arm takes seconds.
    arms = (load_arm("stanford"), random_arm(rng, 4)) if sample.whole else (random_arm(rng, 3),)
    for arm in arms:
        assert_agrees(name, arm, rng)
    sample.record(f"compiled {name} is that of the plain function, arms", len(arms), 0)


def assert_agrees(name: str, arm: Arm, rng: np.random.Generator) -> None:
    """Check one quantity of one arm."""
    fast = compile_arm(arm)
    inputs = _inputs(fast, name, rng, (4, 5))

    found = _all(getattr(fast, name)(*inputs))

    for values, expected in zip(found, _all(PLAIN[name](fast.arm, *inputs)), strict=True):
        assert values.shape == expected.shape
        np.testing.assert_allclose(values, expected, atol=ROUNDING * max(1.0, np.abs(expected).max()))
    alone = _all(getattr(fast, name)(*(x[2, 3] for x in inputs)))
    for one, values in zip(alone, found, strict=True):
        np.testing.assert_array_equal(one, values[2, 3])


def test_every_quantity_is_compared() -> None:
    """The list above is whole."""
    assert {*PLAIN, "inverse_branches"} == set(quantity_names())


def test_branches(sample: Sample) -> None:
    """Compiled branches are those of the plain function: in reach and out of it, and where a joint is free."""
    arms = some_of(sample, [load_arm(name) for name in ("puma560-seed", "ur5", *["stanford"] * WHOLE)])
    for arm in arms:
        assert_branches(arm, np.random.default_rng(sample.seed))
    sample.record("compiled branches are those of the plain function, arms", len(arms), 0)


def some_of(sample: Sample, arms: Sequence[Arm]) -> list[Arm]:
    """Return one of some arms, another in every run, and all of them in `make proof`: to compile takes seconds."""
    return list(arms) if sample.whole else [arms[sample.seed % len(arms)]]


def assert_branches(arm: Arm, rng: np.random.Generator) -> None:
    """Check the branches of one arm."""
    fast = compile_arm(arm).inverse_branches
    configurations = random_configurations(arm, rng, 300)
    configurations[:100, 4] = 0.0
    X, near = forward(arm, configurations), np.tile(arm.limits.lower * 0.3, (300, 1))
    X[250:, :3, 3] *= 2.0

    q, singular = fast(X, near)

    expected, expected_singular = inverse_branches(arm, X, near)
    np.testing.assert_array_equal(singular, expected_singular)
    assert singular.dtype == bool
    assert singular[:100].any()
    assert not singular[100:].any()
    # Configurations may differ by rounding where the arm is stretched out; what they put the hand at may not.
    np.testing.assert_allclose(forward(arm, q), forward(arm, expected), atol=1e-9)
    in_reach = np.linalg.norm(forward(arm, q)[..., :3, 3] - X[:, None, :3, 3], axis=-1).max(axis=-1) < 1e-9
    assert in_reach[:250].all()
    alone, free = fast(X[7], near[7])
    np.testing.assert_array_equal(alone, q[7])
    np.testing.assert_array_equal(free, singular[7])


def test_no_closed_form() -> None:
    """An arm without closed form says so when its branches are asked for."""
    with pytest.raises(UnsupportedArmError, match="'random': no closed-form inverse"):
        _ = compile_arm(random_arm(np.random.default_rng(0), 6)).inverse_branches


@pytest.mark.parametrize("name", ["forward_dynamics", "forward_dynamics_derivatives"])
def test_an_inertia_that_is_rounding(name: str) -> None:
    """A mass on the axis of its joint, of which rounding leaves an inertia, is refused as well."""
    refused = 0
    for alpha in np.linspace(0.1, 1.4, 12):
        on_axis = (-0.3, 0.7 * np.sin(alpha), 0.7 * np.cos(alpha))
        joints = [Joint(kind="revolute", a=1.0, alpha=0.4), Joint(kind="revolute", a=0.3, alpha=alpha)]
        arm = Arm(name="skew", joints=joints, links=[Link(mass=1.0), Link(mass=1.0, com=on_axis)])
        with pytest.raises(UnsupportedArmError, match="the acceleration of joint 2 is undefined"):
            getattr(compile_arm(arm), name)([0.3, 0.4], [0.1, 0.2], [0.0, 0.0])
        refused += abs(mass_matrix(arm, [0.3, 0.4])[1, 1]) > 0
    assert refused


def test_an_arm_that_moves_nothing() -> None:
    """A joint without inertia is refused by the compiled forward dynamics in the words of the plain one."""
    light = Arm(name="light", joints=[Joint(kind="revolute", a=1.0)] * 2, links=[Link(mass=1.0), Link()])

    for shape in ((2,), (5, 2)):
        with pytest.raises(UnsupportedArmError, match="the acceleration of joint 2 is undefined"):
            compile_arm(light).forward_dynamics(np.zeros(shape), np.zeros(shape), np.zeros(shape))


def test_called_from_other_compiled_code(rng: np.random.Generator) -> None:
    """A compiled loop that calls the function of one configuration gets the bits that a batch has."""
    arm = load_arm("stanford-jpl")
    fast = compile_arm(arm)
    one = fast.kernel("inverse_dynamics").single

    @njit
    def efforts(q: Array, qd: Array, qdd: Array, tau: Array) -> int:
        lost = 0
        for k in range(len(q)):
            lost += one(q[k], qd[k], qdd[k], tau[k])
        return lost

    q, qd, qdd = rng.normal(size=(3, 50, arm.n))
    tau = np.empty_like(q)

    assert efforts(q, qd, qdd, tau) == 0

    np.testing.assert_array_equal(tau, fast.inverse_dynamics(q, qd, qdd))


def test_into_arrays_of_the_callers(rng: np.random.Generator) -> None:
    """Results can be written into arrays at hand; arrays that do not fit are refused with what would."""
    fast = compile_arm(load_arm("stanford"))
    q = rng.normal(size=(7, 6))
    X, J = np.empty((7, 4, 4)), np.empty((7, 6, 6))

    assert fast.pose_and_jacobian(q, out=(X, J))[0] is X

    np.testing.assert_array_equal(J, fast.pose_and_jacobian(q)[1])
    with pytest.raises(ShapeError, match=r"out: expected writable arrays in C order, \(7, 4, 4\) float64; got \(4, 4"):
        fast.forward(q, out=np.empty((4, 4)))


@pytest.mark.parametrize("shape", [(6,), (3, 6)])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none(shape: tuple[int, ...], bad: float) -> None:
    """One NaN or infinity among the inputs is refused by name, alone and in a batch."""
    qd = np.zeros(shape)
    qd[..., 3] = bad

    with pytest.raises(InvalidValueError, match="qd: every number must be finite"):
        compile_arm(load_arm("stanford")).inverse_dynamics(np.zeros(shape), qd, np.zeros(shape))


def test_other_kinds_of_input(rng: np.random.Generator) -> None:
    """Lists, whole numbers, read-only and scattered arrays give what the array of the same numbers gives."""
    fast = compile_arm(load_arm("stanford")).forward
    q = rng.integers(-3, 3, size=6)
    expected = fast(q.astype(np.float64))
    wide = np.zeros(12)
    wide[::2] = q
    still = q.astype(np.float64)
    still.setflags(write=False)

    for same in (q, q.tolist(), tuple(q.tolist()), wide[::2], still):
        np.testing.assert_array_equal(fast(same), expected)


def test_unknown_quantity() -> None:
    """A misspelt quantity gets the nearest name."""
    with pytest.raises(UnknownNameError, match="Did you mean 'jacobian'"):
        emit_quantity(load_arm("ur5"), "jacobain")


def test_right_angles_make_it_cheaper() -> None:
    """With oblique axes the same arm takes more operations, for every quantity that all arms have."""

    def total(arm: Arm, quantity: str) -> int:
        return sum(emit_quantity(arm, quantity).operations.values())

    for arm in (load_arm("stanford"), load_arm("ur5")):
        oblique = attrs.evolve(arm, joints=[attrs.evolve(joint, alpha=joint.alpha + 0.3) for joint in arm.joints])
        for quantity in PLAIN:
            assert total(arm, quantity) < total(oblique, quantity)


def test_help() -> None:
    """Every function is a method whose signature and docstring an editor and ``help`` show, with an arm and without."""
    fast = compile_arm(load_arm("stanford"))

    for name in quantity_names():
        method, function = getattr(CompiledArm, name), getattr(fast, name)
        of_arm = inspect.signature(function)
        assert [*inspect.signature(method).parameters] == ["self", *of_arm.parameters]
        assert [*of_arm.parameters] == [*fast.kernel(name).emitted.inputs, "threads", "out"]
        assert len(str(of_arm)) < 200
        assert function.__name__ == name
        assert function.__doc__ == method.__doc__
    assert str(inspect.signature(fast.forward)) == "(q, *, threads=None, out=None)"
    assert str(inspect.signature(CompiledArm.forward)).startswith("(self, q: 'ArrayLike', *, threads: 'int | None'")
    assert "[N m] or [N]" in (fast.inverse_dynamics.__doc__ or "")
    with pytest.raises(TypeError, match="missing a required argument: 'qdd'"):
        fast.inverse_dynamics(np.zeros(6), np.zeros(6))  # type: ignore[call-arg]


def test_called_by_the_class(rng: np.random.Generator) -> None:
    """A method called with its arm as first argument, as a method may be, gives the bits of the arm's function."""
    fast, q = compile_arm(load_arm("stanford")), rng.normal(size=(3, 6))

    np.testing.assert_array_equal(CompiledArm.forward(fast, q), fast.forward(q=q))
    for by_class, of_arm in zip(CompiledArm.pose_and_jacobian(fast, q), fast.pose_and_jacobian(q), strict=True):
        np.testing.assert_array_equal(by_class, of_arm)


def test_asked_for_again() -> None:
    """An arm that has been compiled comes back with its functions, for its content and not for the object at hand."""
    stanford = load_arm("stanford")
    fast = compile_arm(stanford)

    assert compile_arm(attrs.evolve(stanford)) is fast
    assert compile_arm(stanford).forward is fast.forward
    assert compile_arm(load_arm("ur5")) is not fast


@pytest.mark.parametrize(
    ("field", "value"),
    [("name", "another"), ("gravity", (-0.0, 0.0, -9.80665)), ("gravity_from", "world"), ("base_link", "floor")],
)
def test_any_other_arm(field: str, value: Any) -> None:
    """An arm that differs in a name, in who says where down is or in the sign of a zero is compiled for itself."""
    arm = load_arm("stanford")
    other = attrs.evolve(arm, **{field: value})

    assert compile_arm(other) is not compile_arm(arm)
    assert getattr(compile_arm(other).arm, field) is getattr(other, field)


def test_no_more_than_some_are_kept() -> None:
    """Of very many arms those asked for last are kept, and an arm that is asked for again stays."""
    arms = [Arm(name=f"arm {i}", joints=[Joint(kind="revolute", a=1.0)]) for i in range(200)]
    first, second = compile_arm(arms[0]), compile_arm(arms[1])
    for arm in arms:
        compile_arm(arm)
        assert compile_arm(arms[0]) is first

    assert compile_arm(arms[1]) is not second


def test_asked_for_by_many_threads() -> None:
    """Threads that ask for one arm at the same time all get the same compiled arm."""
    arm = Arm(name="of many threads", joints=[Joint(kind="revolute", a=1.0)] * 6)
    with ThreadPoolExecutor(8) as pool:
        compiled = list(pool.map(compile_arm, [attrs.evolve(arm) for _ in range(100)]))

    assert all(one is compiled[0] for one in compiled)


def test_plain_functions_keep_their_bits(rng: np.random.Generator) -> None:
    """The plain functions are the reference: no arm that was compiled before changes a bit of what they give.

    Neither does an equal arm, which differs in the signs of its zeros.
    """
    q, qd, qdd = rng.normal(size=(3, 4, 6))

    def plain(arm: Arm) -> list[bytes]:
        X = forward(arm, q)
        kinematics = (X, jacobian(arm, q), *inverse_branches(arm, X, q), inverse(arm, X[0], q[0]).branches[0].q)
        dynamics = (inverse_dynamics(arm, q, qd, qdd), mass_matrix(arm, q), forward_dynamics(arm, q, qd, qdd))
        return [array.tobytes() for array in (*kinematics, *dynamics)]

    untouched, arm = (attrs.evolve(load_arm("stanford"), name=name) for name in ("untouched", "compiled"))
    expected = plain(untouched)
    for same in (attrs.evolve(arm, base=np.where(arm.base == 0, -0.0, arm.base)), arm):
        fast = compile_arm(same)
        fast.inverse_dynamics(q, qd, qdd)
        fast.inverse_branches(fast.forward(q), q)
        assert plain(arm) == expected
    compile_arm(untouched).forward(q)
    assert plain(untouched) == expected


def test_to_another_process(rng: np.random.Generator) -> None:
    """A compiled arm that has been used can be sent to another process, and gives the same bits there."""
    fast = compile_arm(load_arm("stanford"))
    q = rng.normal(size=6)
    X = fast.forward(q)

    np.testing.assert_array_equal(pickle.loads(pickle.dumps(fast)).forward(q), X)


def test_one_function_to_another_process() -> None:
    """So can one of its functions, which is there the function of the same arm."""
    fast = compile_arm(load_arm("stanford"))

    assert pickle.loads(pickle.dumps(fast.forward)) == fast.forward


def test_little_effort(rng: np.random.Generator) -> None:
    """An arm that was compiled with the least effort has the same bits; it stays such an arm in other processes."""
    arm = random_arm(rng, 4)
    q, qd, qdd = random_configurations(arm, rng, 9), *rng.normal(size=(2, 9, 4))
    fast, quick = compile_arm(arm), compile_arm(arm, quickly=True)

    assert quick is not fast
    np.testing.assert_array_equal(quick.inverse_dynamics(q, qd, qdd), fast.inverse_dynamics(q, qd, qdd))
    np.testing.assert_array_equal(quick.pose_and_jacobian(q)[1], fast.pose_and_jacobian(q)[1])
    assert pickle.loads(pickle.dumps(quick)) == quick
    assert pickle.loads(pickle.dumps(quick.forward)) == quick.forward


def test_without_memory_for_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the system refuses memory for code, a program plans with the arm itself, and a warning says so."""
    arm = load_arm("stanford")
    assert planning_arm(arm) is compile_arm(arm, quickly=True)

    monkeypatch.setattr("armwright.tracing.image._protect", lambda: lambda *_: -1)
    monkeypatch.setattr("armwright.compiled.arm.can_be_placed", can_be_placed.__wrapped__)
    if CAN_BE_LINKED:
        with pytest.warns(CompilerWarning, match="refuses memory that can be executed"):
            assert planning_arm(arm) is arm
        assert not can_be_compiled()


def test_arms_that_differ_in_the_sign_of_a_zero() -> None:
    """Arms that are equal but not to the bit are two: zeros of either sign come out as the arm has them."""
    arms = [Arm(name="lever", joints=[Joint(kind="revolute", d=zero, a=0.5, alpha=0.1)]) for zero in (0.0, -0.0)]
    assert arms[0] == arms[1]

    compiled = [compile_arm(arm) for arm in arms]

    assert compiled[0] is not compiled[1]
    assert [math.copysign(1, each.arm.joints[0].d) for each in compiled] == [1, -1]
    assert compile_arm(Arm(name="lever", joints=arms[1].joints)) is compiled[1]
