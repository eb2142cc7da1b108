"""Whatever is handed to a public function: the right answer, or an error of ours that says what, got and expected."""

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import armwright
from armwright.arm.limits import Limits
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.dynamics.accelerations import toacc
from armwright.dynamics.bejczy import bejczy_efforts, fitted
from armwright.dynamics.energy import kinetic_energy
from armwright.errors import (
    ArmwrightError,
    InvalidValueError,
    KindError,
    ShapeError,
    UnknownNameError,
    UnsupportedArmError,
)
from armwright.kinematics.damped_least_squares import damped_rates
from armwright.kinematics.differential import differential_inverse
from armwright.kinematics.inverse_kinematics.revolutions import equivalent_configurations
from armwright.kinematics.jacobians import jacobian_rate, tool_twist
from armwright.kinematics.manipulability_index import manipulability
from armwright.kinematics.singularity_analysis import singularity_factors
from armwright.simulation.controllers import gravity_compensation, pd, standing
from armwright.simulation.integrators import Adaptive, Gill
from armwright.simulation.result import Brake, Status
from doors import DOORS, MANY, ONE, OTHER, PUMA, Door, Q

WRONG: dict[str, tuple[Any, type[ArmwrightError], str]] = {
    "a text": ("abc", KindError, "expected numbers, got 'abc'"),
    "numbers in quotes": (["1", "2", "3", "4", "5", "6"], KindError, "expected numbers, got ['1', '2'"),
    "a number in quotes": ([0, 0, 0, 0, 0, "1"], KindError, "expected numbers, got [0, 0, 0, 0, 0, '1']"),
    "nothing in a place": ([0, 0, 0, 0, 0, None], KindError, "expected numbers, got [0, 0, 0, 0, 0, None]"),
    "truth values": (np.ones(6, dtype=bool), KindError, "expected numbers, got array([ True"),
    "complex numbers": ([0, 0, 0, 0, 0, 1j], KindError, "expected numbers, got [0, 0, 0, 0, 0, 1j]"),
    "complex array": (np.zeros(6, dtype=complex), KindError, "expected numbers, got array([0.+0.j"),
    "dates": (np.zeros(6, dtype="datetime64[s]"), KindError, "expected numbers, got array(['1970"),
    "a dictionary": ({"q": Q}, KindError, "expected numbers, got {'q': "),
    "a function": (len, KindError, "expected numbers, got <built-in function len>"),
    "an iterator": (iter(Q), KindError, "expected numbers, got <tuple_iterator"),
    "ragged rows": ([[0, 0], [0]], ShapeError, "expected numbers in rows of one length, got [[0, 0], [0]]"),
    "rows of different joints": ([Q, Q[:5]], ShapeError, "expected numbers in rows of one length, got [(0.1, "),
    "not a number": ([0, 0, 0, 0, np.nan, 0], InvalidValueError, "every number must be finite, got nan at (4,)"),
    "endless": ([0, 0, 0, 0, 0, -np.inf], InvalidValueError, "every number must be finite, got -inf at (5,)"),
    "larger than anything": ([1e300, 0, 0, 0, 0, 0], InvalidValueError, "no larger than 1e+100, got 1e+300 at (0,)"),
    "of many digits": ([10**400, 0, 0, 0, 0, 0], InvalidValueError, "expected numbers no larger than"),
    "masked": (np.ma.array(Q, mask=[0, 1, 0, 0, 0, 0]), InvalidValueError, "masked entries have no value"),
    "one too few": (Q[:5], ShapeError, "(5,)"),
    "one too many": ((*Q, 0.0), ShapeError, "(7,)"),
    "none at all": ([], ShapeError, "(0,)"),
    "a column": (np.zeros((6, 1)), ShapeError, "(6, 1)"),
}
# All one and the same six numbers, 0 to 5 eighths.
SAME: dict[str, Any] = {
    "a tuple": (0.0, 0.125, 0.25, 0.375, 0.5, 0.625),
    "an array": np.arange(6) / 8,
    "single precision": np.arange(6, dtype=np.float32) / 8,
    "half precision": np.arange(6, dtype=np.float16) / 8,
    "long": np.arange(6, dtype=np.longdouble) / 8,
    "read-only": np.frombuffer((np.arange(6) / 8).tobytes()),
    "every other": (np.arange(12) / 16)[::2],
    "backwards": (np.arange(5, -1, -1) / 8)[::-1],
    "fractions": [Fraction(i, 8) for i in range(6)],
    "objects": np.array([Fraction(i, 8) for i in range(6)], dtype=object),
    "other byte order": (np.arange(6) / 8).astype(">f8"),
    "not masked": np.ma.array(np.arange(6) / 8, mask=False),
}


@pytest.mark.parametrize("door", DOORS)
def test_what_are_no_joint_positions(door: str) -> None:
    """What is no array of six numbers is refused, and the message begins with the argument and ends with what came."""
    begins, answers = door.partition(": ")[2] + ":", {}
    for what, (value, kind, said) in WRONG.items():
        try:
            DOORS[door](iter(Q) if what == "an iterator" else value)
        except kind as error:
            if str(error).startswith(begins) and said in str(error):
                continue
            answers[what] = str(error)
        except Exception as error:  # noqa: BLE001 - another one than expected
            answers[what] = repr(error)
        else:
            answers[what] = "taken for joint positions"

    assert answers == {}


@pytest.mark.parametrize("door", DOORS)
def test_one_number_for_all(door: str) -> None:
    """A single number stands for six only where one gain may stand for all."""
    call = DOORS[door]
    if door in {"pd: kp", "computed_torque: kd"}:
        np.testing.assert_array_equal(call(0.5), call([0.5] * 6))
        return
    with pytest.raises(ShapeError, match=r"got (shape )?\(\)"):
        call(0.5)


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.drawn(0.4)
def test_the_same_numbers_differently(door: str) -> None:
    """How numbers are stored makes no difference, to the last bit, and what was handed in stays as it was."""
    expected = DOORS[door]([i / 8 for i in range(6)])
    for how, value in SAME.items():
        before = np.array(value, dtype=np.float64)

        np.testing.assert_array_equal(DOORS[door](value), expected, err_msg=how)

        np.testing.assert_array_equal(np.array(value, dtype=np.float64), before, err_msg=how)


@pytest.mark.parametrize("door", DOORS)
def test_whole_numbers(door: str) -> None:
    """Whole numbers are numbers: zeros of any integer kind are zeros."""
    call = DOORS[door]

    for kind in (np.int8, np.int64, np.uint16):
        np.testing.assert_array_equal(call(np.ones(6, dtype=kind)), call([1.0] * 6))


@pytest.mark.parametrize("door", MANY)
def test_leading_axes(door: str) -> None:
    """Rows give the answers of each row, stored in whatever order; no rows give no answers."""
    call = MANY[door]
    rows = np.random.default_rng(3).uniform(-1, 1, size=(2, 3, 6))

    found = call(rows)

    each = np.array([[call(row) for row in plane] for plane in rows])
    np.testing.assert_allclose(found, each, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(call(np.asfortranarray(rows)), found)
    np.testing.assert_array_equal(call(rows[:, ::-1]), found[:, ::-1])
    assert call(np.zeros((0, 6))).shape == (0, *found.shape[2:])
    assert call(np.zeros((2, 0, 6))).shape == (2, 0, *found.shape[2:])


@pytest.mark.parametrize("door", ONE)
def test_one_configuration_only(door: str) -> None:
    """Where one configuration is asked for, two are refused."""
    with pytest.raises(ShapeError, match=r"expected .*(\(6,\), got|got shape) \(2, 6\)"):
        ONE[door]([Q, Q])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda a, b: jacobian_rate(PUMA, a, b), "q, qd"),
        (lambda a, b: tool_twist(PUMA, a, b), "q, qd"),
        (lambda a, b: damped_rates(PUMA, a, b), "q, twist"),
        (lambda a, b: differential_inverse(PUMA, a, b), "q, twist"),
        (lambda a, b: armwright.dynamics.inverse_dynamics(PUMA, a, b, Q), "q, qd, qdd"),
        (lambda a, b: armwright.dynamics.inverse_dynamics(PUMA, a, Q, Q, wrench=b), "q, qd, qdd, wrench"),
        (lambda a, b: armwright.dynamics.forward_dynamics(PUMA, a, Q, b), "q, qd, tau"),
        (lambda a, b: toacc(PUMA, a, b, Q), "q, qd, tau"),
        (lambda a, b: armwright.dynamics.terms(PUMA, a, b, Q), "q, qd, qdd"),
        (lambda a, b: kinetic_energy(PUMA, a, b), "q, qd"),
        (bejczy_efforts, "q, qdd"),
    ],
)
def test_leading_axes_that_do_not_fit(call: Callable[[Any, Any], Any], said: str) -> None:
    """Two rows of one argument and three of another belong to nothing, and both shapes are told."""
    with pytest.raises(ShapeError, match=rf"^{said}: leading axes must broadcast together, got .*\(2, 6\).*\(3, 6\)"):
        call(np.zeros((2, 6)), np.zeros((3, 6)))


NO_ARM: dict[str, Door] = {
    "forward": lambda arm: armwright.kinematics.forward(arm, Q),
    "link_poses": lambda arm: armwright.kinematics.link_poses(arm, Q),
    "jacobian": lambda arm: armwright.kinematics.jacobian(arm, Q),
    "singularities": lambda arm: armwright.kinematics.singularities(arm, Q),
    "singularity_factors": lambda arm: singularity_factors(arm, Q),
    "differential_inverse": lambda arm: differential_inverse(arm, Q, Q),
    "inverse_dynamics": lambda arm: armwright.dynamics.inverse_dynamics(arm, Q, Q, Q),
    "mass_matrix": lambda arm: armwright.dynamics.mass_matrix(arm, Q),
    "forward_dynamics": lambda arm: armwright.dynamics.forward_dynamics(arm, Q, Q, Q),
    "terms": lambda arm: armwright.dynamics.terms(arm, Q, Q, Q),
    "simulate": lambda arm: armwright.simulation.simulate(arm, Q, duration=1.0),
    "inverse": lambda arm: armwright.kinematics.inverse(arm, np.eye(4)),
    "inverse_branches": lambda arm: armwright.kinematics.inverse_branches(arm, np.eye(4)),
    "payload": lambda arm: armwright.dynamics.payload(arm, 1.0),
    "point_to_point": lambda arm: armwright.motion.point_to_point(arm, Q, OTHER),
    "gravity_compensation": gravity_compensation,
    "fitted": lambda arm: fitted(arm, [Q] * 20),
}


@pytest.mark.parametrize("door", NO_ARM)
@pytest.mark.parametrize("value", ["puma560", None, 6, Joint(kind="revolute")])
def test_what_is_no_arm(door: str, value: object) -> None:
    """A name is no arm, nor is anything else but an arm; the message says how to get one."""
    expected = re.escape(f"arm: expected an Arm, such as load_arm('puma560') returns, got {value!r}"[:100])
    with pytest.raises(KindError, match=f"^{expected}"):
        NO_ARM[door](value)


X = armwright.kinematics.forward(PUMA, Q)
MIRROR = np.diag((1.0, 1.0, -1.0, 1.0))
POSES: dict[str, tuple[Any, type[ArmwrightError], str]] = {
    "a text": ("here", KindError, "expected numbers, got 'here'"),
    "a place": (X[:3, 3], ShapeError, "expected a shape ending in (4, 4), got (3,)"),
    "a rotation": (X[:3, :3], ShapeError, "expected a shape ending in (4, 4), got (3, 3)"),
    "three rows": (X[:3], ShapeError, "expected a shape ending in (4, 4), got (3, 4)"),
    "not a number": (X * np.nan, InvalidValueError, "every number must be finite, got nan at (0, 0)"),
    "farther than anything": (X + 1e200 * np.eye(4, k=3), InvalidValueError, "expected numbers no larger than 1e+100"),
    "transposed": (X.T, InvalidValueError, "; is it transposed?"),
    "another last row": (np.diag((1.0, 1, 1, 2)), InvalidValueError, "as the last row, got [0.0, 0.0, 0.0, 2.0]"),
    "a last row of zeros": (np.diag((1.0, 1, 1, 0)), InvalidValueError, "as the last row, got [0.0, 0.0, 0.0, 0.0]"),
    "a mirror image": (X @ MIRROR, InvalidValueError, "it is a mirror image: one axis is reversed"),
    "twice the size": (np.diag((2.0, 2, 2, 1)), InvalidValueError, "orthonormal to 0.02, got one with an error of 3: "),
    "sheared": (X + 0.1 * np.eye(4, k=1) * [[1], [1], [0], [0]], InvalidValueError, "expected a rotation, orthonormal"),
    "no rotation": (np.diag((0.0, 0, 0, 1)), InvalidValueError, "expected a rotation, orthonormal to 0.02"),
}


@pytest.mark.parametrize("what", POSES)
@pytest.mark.parametrize("ask", [armwright.kinematics.inverse, armwright.kinematics.inverse_branches])
def test_what_is_no_pose(ask: Callable[..., object], what: str) -> None:
    """What is no pose is refused with a reason before any configuration is sought, alone or among others."""
    value, kind, said = POSES[what]
    with pytest.raises(kind, match=f"^pose: .*{re.escape(said)}"):
        ask(PUMA, value)


def test_one_pose_only() -> None:
    """Where one pose is asked for many are refused, and none as well; the message says what takes many."""
    for poses in ([X, X], np.zeros((0, 4, 4))):
        with pytest.raises(
            ShapeError, match=r"pose: expected one pose, shape \(4, 4\), got .* inverse_branches takes arrays"
        ):
            armwright.kinematics.inverse(PUMA, poses)
    q, singular = armwright.kinematics.inverse_branches(PUMA, np.zeros((0, 4, 4)))
    assert (q.shape, singular.shape) == ((0, 8, 6), (0, 8))


NUMBERS: dict[str, Door] = {
    "duration": lambda x: armwright.simulation.simulate(PUMA, Q, duration=x),
    "period": lambda x: armwright.simulation.simulate(PUMA, Q, duration=1.0, period=x),
    "Gill: length": lambda x: Gill(length=x),
    "Adaptive: rtol": lambda x: Adaptive(rtol=x),
    "threshold": lambda x: armwright.kinematics.singularities(PUMA, Q, threshold=x),
    "length": lambda x: manipulability(PUMA, Q, length=x),
    "damping": lambda x: damped_rates(PUMA, Q, Q, damping=x),
    "speed": lambda x: armwright.motion.point_to_point(PUMA, Q, OTHER, x),
    "duration of a quintic": lambda x: armwright.motion.quintic(Q, OTHER, x),
    "factor": lambda x: armwright.motion.quintic(Q, OTHER, 1.0).slowed(x),
    "joint: theta": lambda x: Joint(kind="revolute", theta=x),
    "limits: lower": lambda x: Limits(lower=x),
    "link: mass": lambda x: Link(mass=x),
    "link: mass of a load": lambda x: armwright.dynamics.payload(PUMA, x),
    "motor: viscous": lambda x: Motor(viscous=x),
    "arm 'a': reach": lambda x: Arm(name="a", joints=PUMA.joints, reach=x),
    "brake: start": lambda x: Brake(joint=0, start=x),
}


@pytest.mark.parametrize("value", ["1", None, [1.0], True, 1j, np.ones(1)])
@pytest.mark.parametrize("door", NUMBERS)
def test_what_is_no_number(door: str, value: object) -> None:
    """Where one number is asked for, a text, a list or a truth value is refused by the name of the argument."""
    what = door.partition(" of ")[0]
    with pytest.raises(KindError, match=rf"^{what}: expected a number, got {re.escape(repr(value))}"):
        NUMBERS[door](value)


@pytest.mark.parametrize("value", [np.nan, -1.0, 10**400, -np.inf])
@pytest.mark.parametrize("door", sorted(NUMBERS.keys() - {"joint: theta", "limits: lower"}))
def test_numbers_without_a_meaning(door: str, value: float) -> None:
    """A time, a length, a mass or a speed below nothing, without end or without a value is refused by its name."""
    with pytest.raises(InvalidValueError, match=door.partition(" of ")[0].rpartition(":")[2].strip()):
        NUMBERS[door](value)


@pytest.mark.parametrize(
    ("call", "kind", "said"),
    [
        (lambda: armwright.load_arm(3), KindError, "name: expected the name of an arm or the path of a file, got 3"),
        (lambda: armwright.load_arm("pumma560"), UnknownNameError, "no arm 'pumma560'. Did you mean 'puma560'?"),
        (
            lambda: armwright.kinematics.jacobian(PUMA, Q, "world"),
            InvalidValueError,
            "frame: expected 'base' or 'tool'",
        ),
        (lambda: armwright.kinematics.jacobian(PUMA, Q, ["base"]), InvalidValueError, "got ['base']"),
        (lambda: tool_twist(PUMA, Q, Q, np.ones(2)), InvalidValueError, "frame: expected 'base' or 'tool'"),
        (lambda: manipulability(PUMA, Q, "yoshikava"), UnknownNameError, "Did you mean 'yoshikawa'?"),
        (lambda: manipulability(PUMA, Q, motion=["all"]), UnknownNameError, "no motion '['all']'."),
        (lambda: differential_inverse(PUMA, Q, Q, method=np.ones(2)), UnknownNameError, "no method '[1. 1.]'."),
        (lambda: Adaptive(method="RK4"), UnknownNameError, "no method 'RK4'"),
        (lambda: armwright.dynamics.terms(PUMA, Q, Q, Q, load=2.0), KindError, "load: expected a Link, got 2.0"),
        (lambda: armwright.dynamics.payload(PUMA, -1.0), InvalidValueError, "mass must be 0 or more, got -1"),
        (
            lambda: armwright.dynamics.payload(PUMA, 1.0, [0, 0]),
            ShapeError,
            "com: expected a shape ending in (3,), got (2,)",
        ),
        (
            lambda: armwright.dynamics.payload(PUMA, 1.0, inertia=np.eye(2)),
            ShapeError,
            "inertia: expected a shape ending in",
        ),
        (
            lambda: armwright.dynamics.inverse_dynamics(PUMA, Q, Q, Q, base_acceleration=9.8),
            ShapeError,
            "base_acceleration: ",
        ),
        (
            lambda: armwright.motion.quintic(Q, OTHER, 1e-30),
            InvalidValueError,
            "duration: expected at least 1e-09 s",
        ),
        (lambda: armwright.motion.quintic(0.0, 1.0, 1.0), ShapeError, "q_start: expected shape (n,), got ()"),
        (lambda: armwright.motion.xspline([0, 1], 3.0), ShapeError, "X-spline: expected k times and (k, n) knots"),
        (lambda: armwright.motion.xspline([0, 1], [[], []]), ShapeError, "X-spline: expected k times and (k, n) knots"),
        (lambda: armwright.motion.xspline([0, 0], [Q, Q]), InvalidValueError, "times must increase, got 0 s"),
        (lambda: armwright.motion.xspline([1, 2], [Q, Q]), InvalidValueError, "times: expected non-decreasing times"),
        (lambda: armwright.motion.quintic(Q, OTHER, 1.0)("x"), KindError, "t: expected numbers, got 'x'"),
        (lambda: armwright.motion.quintic(Q, OTHER, 1.0)(0.5, 1.5), KindError, "order: expected an integer, got 1.5"),
        (lambda: armwright.Trajectory(times=[0, 1], coefficients=Q), ShapeError, "coefficients: expected (segments,"),
        (lambda: fitted(armwright.load_arm("stanford"), Q), ShapeError, "q: expected (m, 6) configurations"),
        (lambda: pd(PUMA, standing(Q), -1.0, 1.0), InvalidValueError, "kp: expected 0 or more for every joint"),
    ],
)
def test_arguments_without_a_meaning(call: Callable[[], object], kind: type[ArmwrightError], said: str) -> None:
    """What has no meaning is refused, by the name of the argument, with what came and what was expected."""
    with pytest.raises(kind, match=re.escape(said)):
        call()


@pytest.mark.parametrize(
    ("call", "kind", "said"),
    [
        (lambda: simulated(controller=3), KindError, "controller: expected a function of t, q and qd"),
        (
            lambda: simulated(controller=lambda *_: [1.0]),
            ShapeError,
            "controller at 0 s: expected shape (6,), got (1,)",
        ),
        (lambda: simulated(controller=lambda *_: "full"), KindError, "controller at 0 s: expected numbers, got 'full'"),
        (lambda: simulated(controller=tired), ShapeError, "efforts of the controller at "),
        (lambda: simulated(integrator="gill"), KindError, "integrator: expected one such as Gill() or Adaptive()"),
        (lambda: simulated(integrator=Gill), KindError, "got <class 'armwright.simulation.integrators.Gill'>"),
        (lambda: simulated(brakes=Brake(joint=0)), KindError, "brakes: expected a list of Brake, got Brake(joint=0"),
        (lambda: simulated(brakes=[0]), KindError, "brakes: expected a list of Brake, got [0]"),
        (lambda: simulated(brakes=[Brake(joint=6)]), InvalidValueError, "brake: expected a joint from 0 to 5, got 6"),
        (lambda: Brake(joint=0.5), KindError, "brake: expected the index of a joint, from 0, got 0.5"),
        (lambda: simulated(duration=1e9), InvalidValueError, "would be 1e+12 samples; expected at most 1e+07"),
    ],
)
def test_simulations_that_cannot_be(call: Callable[[], object], kind: type[ArmwrightError], said: str) -> None:
    """A controller that is none, another arm's efforts, brakes of no joint, times without end: each is told."""
    with pytest.raises(kind, match=re.escape(said)):
        call()


def simulated(**options: Any) -> Any:
    return armwright.simulation.simulate(PUMA, Q, **{"duration": 0.01, **options})


def tired(t: float, _q: object, _qd: object) -> list[float]:
    """Efforts of six joints, and later of two."""
    return [0.0] * (6 if t < 2e-3 else 2)


@pytest.mark.parametrize("integrator", [Gill(length=1e-2), Adaptive(), Adaptive(method="BDF")])
@pytest.mark.parametrize("effort", [lambda qd: 1e3 * qd, lambda qd: qd * np.nan, lambda qd: 1e99 + qd])
def test_runaway_is_a_status(integrator: Gill | Adaptive, effort: Callable[[Any], Any]) -> None:
    """A controller that pushes without measure ends the motion, and the result keeps what was, in numbers."""
    block = Arm(name="block", joints=[Joint(kind="prismatic")], links=[Link(mass=2.0)])

    def controller(t: float, _q: object, qd: Any) -> Any:
        return effort(qd) if t > 0 else qd * 0

    found = armwright.simulation.simulate(
        block, [1.0], [1.0], duration=5.0, controller=controller, integrator=integrator
    )

    assert found.status in {Status.DIVERGED, Status.IMPRECISE}
    assert np.isfinite(found.q).all()
    assert np.isfinite(found.energy).all()


@pytest.mark.parametrize(
    "ask",
    [
        lambda arm: armwright.dynamics.forward_dynamics(arm, [0.1, 0.2], [0, 0], [0, 0]),
        lambda arm: armwright.dynamics.forward_dynamics(arm, [[0.1, 0.2]] * 3, [0, 0], [0, 0]),
        lambda arm: toacc(arm, [0.1, 0.2], [0, 0], [0, 0]),
        lambda arm: armwright.simulation.simulate(arm, [0.1, 0.2], duration=1.0),
    ],
)
def test_a_hand_without_inertia(ask: Door) -> None:
    """Of a joint that moves nothing no acceleration can be found: the joint is named, and what to give it."""
    joints = [Joint(kind="revolute", a=0.5), Joint(kind="revolute", a=0.5)]
    arm = Arm(name="light", joints=joints, links=[Link(mass=1.0), Link()])

    with pytest.raises(UnsupportedArmError, match=r"'light': the acceleration of joint 2 is undefined: .* Give its"):
        ask(arm)


STANFORD = "examples/stanford_cell.toml"
STACKING = "examples/stacking.rlo"


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: armwright.program.run(None), KindError, "program: expected the path of a file or a Source, got None"),
        (lambda: armwright.program.compile(b"x"), KindError, "program: expected the path"),
        (lambda: armwright.program.run(STACKING, {}), KindError, "cell: expected a Cell or the path of its file"),
        (lambda: armwright.program.compile(STACKING, std="84"), UnknownNameError, "84"),
        (lambda: armwright.program.run(STACKING, STANFORD, limits=5), KindError, "limits: expected Limits, got 5"),
        (
            lambda: armwright.program.run(armwright.program.compile(STACKING, STANFORD), STANFORD),
            InvalidValueError,
            "a compiled program has its cell",
        ),
        (lambda: armwright.cell.read_cell(3), KindError, "expected the path of a file, got 3"),
        (lambda: armwright.clearance.load_linkage(3), KindError, "expected the path of a file, got 3"),
        (lambda: armwright.accuracy.read_measurements([3]), KindError, "expected the path of a file, got 3"),
        (
            lambda: armwright.calibration.read_measurements(b"x", PUMA),
            KindError,
            "expected the path of a file, got b'x'",
        ),
        (lambda: armwright.arm.toml_text("puma560"), KindError, "arm: expected an Arm"),
        (lambda: armwright.arm.urdf_text("puma560"), KindError, "arm: expected an Arm"),
        (lambda: equivalent_configurations(PUMA, np.zeros((2, 6))), ShapeError, "expected shape"),
    ],
)
def test_arguments_of_other_functions(call: Callable[[], object], error: type[Exception], message: str) -> None:
    """Programs, arms and configurations of the wrong kind are refused by name."""
    with pytest.raises(error, match=message):
        call()


def test_names_are_compiled_to_their_end() -> None:
    """A program of which only the names were compiled runs like one that was compiled whole."""
    names_only = armwright.program.compile(STACKING, STANFORD, names_only=True)
    assert armwright.program.run(names_only).duration == armwright.program.run(STACKING, STANFORD).duration


@pytest.mark.parametrize("namespace", [armwright.sweep, armwright.study])
def test_namespaces_list_their_names(namespace: Any) -> None:
    """A namespace lists what it has, and each of it is there."""
    assert namespace.__all__
    assert all(hasattr(namespace, name) for name in dir(namespace))
