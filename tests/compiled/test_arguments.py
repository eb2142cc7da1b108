"""What compiled functions are handed: they answer or refuse as the plain functions of the same names do."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import njit

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import LARGEST
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import ArmwrightError, InvalidValueError, ShapeError, UnitWarning
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.revolutions import equivalent_configurations
from armwright.kinematics.jacobians import jacobian
from samples import Sample

PUMA = load_arm("puma560")
PLAIN: dict[str, Callable[..., Any]] = {
    "forward": forward,
    "jacobian": jacobian,
    "inverse_dynamics": inverse_dynamics,
}
WIDTHS = {"forward": 1, "jacobian": 1, "inverse_dynamics": 3}


@pytest.fixture(scope="module")
def fast() -> CompiledArm:
    return compile_arm(PUMA)


def answer(function: Callable[..., Any], *arguments: Any) -> tuple[Any, type[Exception] | None, list[str]]:
    """What a call returns, or the kind of its error, and what it warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return function(*arguments), None, [str(one.message) for one in caught]
        except ArmwrightError as error:
            return None, type(error), [str(one.message) for one in caught]


@pytest.mark.parametrize("value", [1e300, -1e200, 1.1e12])
@pytest.mark.parametrize("lead", [(), (1,), (5,), (2, 3)])
def test_numbers_too_large(fast: CompiledArm, value: float, lead: tuple[int, ...]) -> None:
    """An angle of which no right sine can be had is refused by name, alone and in a batch, also beside its opposite.

    So is a number of which no products can be had; accelerations beyond those angles are none of them.
    """
    q = np.zeros((*lead, 6))
    q[..., 2], q[..., 3] = value, -value

    with pytest.raises(InvalidValueError, match=r"q: expected numbers no larger than 1e\+12, got "):
        fast.forward(q)
    still = np.zeros_like(q)
    if abs(value) < LARGEST:
        assert np.isfinite(fast.inverse_dynamics(still, still, q)).all()
        return
    with pytest.raises(InvalidValueError, match=r"qdd: expected numbers no larger than 1e\+100, got "):
        fast.inverse_dynamics(still, still, q)


def test_large_angles_are_right(fast: CompiledArm, sample: Sample) -> None:
    """Up to 1e12 rad, where a double tells angles 1e-4 apart, the pose is that of the plain function."""
    worst = tried = 0.0
    for rng in sample.cases(300):
        size = 10 ** rng.uniform(1, 11.9)
        q = rng.uniform(-size, size, 6)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnitWarning)
            worst = max(worst, float(np.abs(fast.forward(q) - forward(PUMA, q)).max()))
        tried += 1
    assert worst < 1e-9
    sample.record("poses at angles up to 1e12 rad against the plain function", int(tried), 0, worst=worst)


@pytest.mark.parametrize("mask", [True, [0, 1, 0, 0, 0, 0]])
def test_masked_entries(fast: CompiledArm, mask: Any) -> None:
    """An array with masked entries is refused in our own words, also by a function that was never called before."""
    q = np.ma.array(np.zeros(6), mask=mask)
    for function in (fast.forward, compile_arm(PUMA).link_poses):
        for given in (q, np.ma.stack([q, q])):
            with pytest.raises(InvalidValueError, match="q: masked entries have no value; fill them or remove them"):
                function(given)


def test_arrays_with_nothing_masked(fast: CompiledArm) -> None:
    """A masked array of which nothing is masked is an array."""
    q = np.full((3, 6), 0.2)
    np.testing.assert_array_equal(fast.forward(np.ma.array(q)), fast.forward(q))


@pytest.mark.parametrize("lead", [(), (4,), (5000,)])
def test_degrees_by_mistake(fast: CompiledArm, lead: tuple[int, ...]) -> None:
    """Positions that look like degrees get the warning of the plain functions, at the line that called."""
    q = np.zeros((*lead, 6))
    q[..., 1] = 90.0

    for function in (fast.forward, fast.kernel("forward")):
        with pytest.warns(UnitWarning, match="q: joint 2 of 'puma560' is at 90 rad, 14.3 revolutions") as caught:
            X = function(q)
        assert [one.filename for one in caught] == [__file__]
        np.testing.assert_allclose(X, np.broadcast_to(forward_in_silence(q[..., :].reshape(-1, 6)[0]), X.shape))


def test_positions_near_which_branches_are_sought(fast: CompiledArm) -> None:
    """They are positions as well: what looks like degrees is warned of, and what is beyond all angles is refused."""
    pose, near = forward(PUMA, np.full(6, 0.3)), np.zeros(6)

    near[1] = 90.0
    with pytest.warns(UnitWarning, match="near: joint 2 of 'puma560' is at 90 rad"):
        fast.inverse_branches(pose, near)
    near[1] = 1.1e12
    with pytest.raises(InvalidValueError, match="near: expected numbers no larger than"):
        fast.inverse_branches(pose, near)


def forward_in_silence(q: np.ndarray) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnitWarning)
        return forward(PUMA, q)


def test_one_and_the_same_answer(fast: CompiledArm, sample: Sample) -> None:
    """Whatever comes, compiled and plain functions give the same numbers, errors of one kind, and the same warnings."""
    tried = 0
    for rng in sample.cases(400):
        name = str(rng.choice(list(PLAIN)))
        lead = [(), (1,), (3,), (2, 2), (0,)][rng.integers(5)]
        arguments = [strange(rng, rng.uniform(-3, 3, (*lead, 6))) for _ in range(WIDTHS[name])]
        got, error, said = answer(getattr(fast, name), *arguments)
        expected, refused, warned = answer(PLAIN[name], PUMA, *arguments)
        assert (error is None) == (refused is None), (name, arguments, error, refused)
        if error is None:
            assert [text.partition(":")[0] for text in said] == [text.partition(":")[0] for text in warned], arguments
            np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(expected).max(initial=0)))
        tried += 1
    sample.record("strange arguments: compiled and plain functions disagree", tried, 0)


def strange(rng: np.random.Generator, array: np.ndarray) -> Any:
    """An array as it is, or with something wrong or unusual about it."""
    if rng.random() < 0.15 and array.size:
        array.flat[rng.integers(array.size)] = rng.choice([np.nan, np.inf, -np.inf, 1e300, -1e101, 120.0, -45.0])
    changes: list[Callable[[np.ndarray], Any]] = [
        lambda x: x[..., : rng.integers(6)],
        np.ndarray.tolist,
        np.asfortranarray,
        lambda x: x.astype(np.float32).astype(object) if np.abs(x).max(initial=0) < 200 else x,
        lambda x: np.ma.array(x, mask=rng.random(x.shape) < 0.05),
        lambda x: x.astype(">f8"),
        lambda x: x.view(np.matrix) if x.ndim == 2 else x,
        lambda _: "abc",
    ]
    change = rng.integers(2 * len(changes))
    return changes[change](array) if change < len(changes) else array


@pytest.mark.parametrize("lead", [(), (1,), (7,)])
def test_arrays_to_fill(fast: CompiledArm, lead: tuple[int, ...], rng: np.random.Generator) -> None:
    """Arrays at hand are filled and come back, for one configuration as for many; what does not fit stays untouched."""
    q = rng.uniform(-1, 1, (*lead, 6))
    X, J = np.empty((*lead, 4, 4)), np.empty((*lead, 6, 6))
    both = (X, J)

    assert fast.pose_and_jacobian(q, out=both) is both or fast.pose_and_jacobian(q, out=both) == both
    np.testing.assert_array_equal(X, fast.forward(q))
    assert fast.forward(q, out=X) is X

    wrong = (
        np.full((*lead, 4, 3), 7.0), np.full((*lead, 4, 4), 7, dtype=np.float32), np.full((*lead, 4, 8), 7.0)[..., ::2],
        np.full((*lead, 5, 4), 7.0), [7.0], 7.0,
    )  # fmt: skip
    for out in wrong:
        with pytest.raises(ShapeError, match=r"^out: expected writable arrays in C order, "):
            fast.forward(q, out=out)
        assert np.all(np.asarray(out) == 7)
    X.setflags(write=False)
    with pytest.raises(ShapeError, match=r"^out: expected writable arrays in C order, "):
        fast.forward(q, out=X)


def test_status_of_one_configuration() -> None:
    """Compiled code that calls the function of one configuration learns what came out without meaning, what is odd."""
    one = compile_arm(PUMA).kernel("forward").single

    @njit
    def status(value: float) -> int:
        q = np.zeros(6)
        q[1] = value
        return one(q, np.empty((4, 4)))  # type: ignore[no-any-return]

    assert [status(x) for x in (0.5, 90.0, 1e13, np.nan, -np.inf)] == [0, 2, 1, 1, 1]


def test_all_images_of_a_configuration() -> None:
    """Where limits allow more than a turn, all images of a branch can be had: each puts the tool where it was."""
    arm: Arm = load_arm("ur5")  # two turns each way: 2 images of every angle but 0
    q = np.array([0.1, -1.2, 1.1, -0.4, 0.9, 0.3])
    configurations, _ = compile_arm(arm).inverse_branches(forward(arm, q), q)

    found = equivalent_configurations(arm, configurations[np.abs(configurations - q).max(axis=-1).argmin()])

    assert len(found) == 2**6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnitWarning)
        np.testing.assert_allclose(forward(arm, found), np.broadcast_to(forward(arm, q), (64, 4, 4)), atol=1e-9)
