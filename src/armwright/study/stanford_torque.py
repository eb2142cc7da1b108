"""The torques of the Stanford arm in a fast move: report TR-83-008, section 4, figures 3 to 11, and appendix III.

The joints move from (0, 0, 0.2, 0, 0, 0) to (1.57, 2.36, 1.0, 1.57, 1.57, 1.57) in one second by a quintic. The
efforts are computed in three cases: Newton-Euler without a payload, Bejczy's model, Newton-Euler with the largest
payload. All include the rotors, as Bejczy's constants do. Gravity points up as in the report, so that the signs agree.
"""

import math
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.bejczy import Coefficients, bejczy_efforts, fitted
from armwright.dynamics.bodies import body_of
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.payloads import payload
from armwright.errors import one_of
from armwright.motion.quintic_polynomials import quintic
from armwright.report.move_figures import Panel

Verdict: TypeAlias = Literal["agrees", "near", "wrong"]

# The report's gravity, which points upward [m/s²].
GRAVITY = 9.80621
START = (0.0, 0.0, 0.2, 0.0, 0.0, 0.0)
GOAL = (1.57, 2.36, 1.0, 1.57, 1.57, 1.57)
DURATION = 1.0  # s
SAMPLES = 201  # the ends included
# The largest payload: a cube with its centre in the origin of the tool frame.
LOAD_MASS = 1.8  # kg
LOAD_VOLUME = 422e-6  # m³
# Seed and number of the configurations that constants are fitted to.
SEED = 83008
CONFIGURATIONS = 2000
# Relative errors up to which printed numbers agree, or are near; half a unit of the last digit agrees too, and a near
# number may result from rounded intermediate results.
AGREES = 0.01
NEAR = 0.05
_EFFORT_UNITS = ("N m", "N m", "N", "N m", "N m", "N m")


def study_arm() -> Arm:
    """Return the arm of the report's program, with the report's gravity."""
    return attrs.evolve(load_arm("stanford-jpl"), gravity=(0.0, 0.0, GRAVITY))


def loaded_arm() -> Arm:
    """Return the arm with the largest payload."""
    cube = LOAD_MASS * LOAD_VOLUME ** (2 / 3) / 6 * np.eye(3)
    return payload(study_arm(), LOAD_MASS, inertia=cube)


@attrs.frozen(kw_only=True, eq=False)
class Torques:
    """The three cases of figures 6 to 11, and the motion of figures 3 to 5, at m times.

    Attributes:
        t: (m,) times [s].
        q: (m, 6) joint positions [rad], the third [m].
        qd: (m, 6) joint speeds.
        qdd: (m, 6) joint accelerations.
        empty: (m, 6) case 1: Newton-Euler without a payload [N m], the third [N].
        bejczy: (m, 6) case 2: Bejczy's model with the constants of the arm.
        loaded: (m, 6) case 3: Newton-Euler with the largest payload.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    empty: Array
    bejczy: Array
    loaded: Array


def torques() -> Torques:
    """Compute the motion and the efforts of all cases.

    Source:
        TR-83-008, section 4, figures 3 to 11.
    """
    motion = quintic(START, GOAL, DURATION)
    t = np.linspace(0.0, DURATION, SAMPLES)
    q, qd, qdd = (motion(t, order) for order in range(3))
    empty, loaded = (inverse_dynamics(arm, q, qd, qdd) for arm in (study_arm(), loaded_arm()))
    bejczy = bejczy_efforts(q, qdd, fitted_coefficients(), gravity=GRAVITY)
    return Torques(t=t, q=q, qd=qd, qdd=qdd, empty=empty, bejczy=bejczy, loaded=loaded)


def figure(study: Torques, number: int) -> Panel:
    """Return the curves of a figure of the report, 3 to 11, over the times of the torques.

    Args:
        study: the torques.
        number: 3 to 5 for position, speed and acceleration of joint 1; 6 to 11 for the efforts of joints 1 to 6.

    Raises:
        UnknownNameError: the report has no such figure of this motion.
    """
    one_of("figure", str(number), map(str, range(3, 12)))
    if number < 6:
        title, unit = (("position", "rad"), ("speed", "rad/s"), ("acceleration", "rad/s²"))[number - 3]
        return Panel(f"{title} of joint 1", unit, {"joint 1": (study.q, study.qd, study.qdd)[number - 3][:, 0]})
    joint = number - 6
    curves = {
        "Newton-Euler, no load": study.empty[:, joint],
        "Bejczy": study.bejczy[:, joint],
        "Newton-Euler, largest load": study.loaded[:, joint],
    }
    return Panel(f"effort of joint {joint + 1}", _EFFORT_UNITS[joint], curves)


@attrs.frozen(kw_only=True)
class JointRow:
    """The differences of the cases at a joint.

    Attributes:
        joint: number of the joint, from 1.
        unit: unit of its efforts.
        peak: largest effort without a payload.
        peak_loaded: largest effort with the largest payload.
        limit: largest effort of the motor, appendix II.
        bejczy: root mean square error of Bejczy's model, relative to the root mean square effort without a payload.
        load: root mean square effect of the payload, relative to the same.
    """

    joint: int
    unit: str
    peak: float
    peak_loaded: float
    limit: float
    bejczy: float
    load: float


def joint_table(study: Torques) -> list[JointRow]:
    """Return the differences of the cases for every joint; by the report they are largest at the wrist."""
    columns = {
        "peak": np.abs(study.empty).max(axis=0),
        "peak_loaded": np.abs(study.loaded).max(axis=0),
        "limit": study_arm().limits.effort,
        "bejczy": _rms(study.bejczy - study.empty) / _rms(study.empty),
        "load": _rms(study.loaded - study.empty) / _rms(study.empty),
    }
    return [
        JointRow(joint=i + 1, unit=unit, **{name: float(column[i]) for name, column in columns.items()})
        for i, unit in enumerate(_EFFORT_UNITS)
    ]


def _rms(efforts: Array) -> Array:
    """Return the root mean square of each joint's efforts over the motion."""
    return np.asarray(np.sqrt(np.mean(efforts**2, axis=0)))


def fit_configurations() -> Array:
    """Return random configurations within the joint limits, to which constants are fitted, (m, 6)."""
    limits = study_arm().limits
    return np.random.default_rng(SEED).uniform(limits.lower, limits.upper, size=(CONFIGURATIONS, 6))


def fitted_coefficients() -> Coefficients:
    """Return the constants of Bejczy's model that are fitted to the arm."""
    return fitted(study_arm(), fit_configurations())


@attrs.frozen(kw_only=True)
class PrintedRow:
    """A number of the report beside that of the arm.

    Attributes:
        name: name in the report.
        unit: unit of both numbers.
        printed: number in the report.
        computed: number of the arm.
        verdict: ``agrees`` to 1 % or half a unit of the last printed digit, ``near`` to 5 %, else ``wrong``.
        note: remark on the error or the source; may be empty.
    """

    name: str
    unit: str
    printed: float
    computed: float
    verdict: Verdict
    note: str = ""


# Name, unit, number as printed, note. The name picks the fitted constant; b4 of the report stands for three of ours.
_PRINTED_CONSTANTS = (
    ("b1", "kg m²", "1.423", ""),
    ("b2", "kg m²", "2.51", ""),
    ("b3", "kg m", "-5.49", ""),
    ("b4", "kg", "7.257", "with the square of q3 in D11 and D22: without the rotor it is m3 + m4 + m5 + m6"),
    ("slide", "kg", "7.257", "b4 as D33: m3 + m4 + m5 + m6 + Jm3"),
    ("b5", "kg m", "0.232", ""),
    ("b13", "kg m²", "4.72", ""),
    ("b14", "kg m²", "0.107", ""),
    ("b15", "kg m²", "0.015", ""),
    ("b17 + b18", "kg m²", "0.112", "D55; only the sum can be found"),
    ("b19", "kg m²", "0.02", ""),
    ("b20", "kg m²", "0.013", "m6 k633² is 0.0003: the printed number repeats that of b18"),
    ("k1", "kg m", "-2.788", "with gravity up, as all of G here; for an arm that stands every G changes its sign"),
    ("k2", "kg", "7.257", "a rotor weighs nothing on the slide: m3 + m4 + m5 + m6"),
    ("k3", "kg m", "0.116", ""),
    ("k3 / b5", "", "0.05", "printed k3 = 0.05 b5; its value 0.116 is half of b5"),
)


def coefficient_table() -> list[PrintedRow]:
    """Return every constant of Bejczy's model as printed and as fitted to the arm.

    Source:
        TR-83-008, appendix III.
    """
    constants = attrs.asdict(fitted_coefficients())
    constants["b17 + b18"] = constants["b17"] + constants["b18"]
    constants["k3 / b5"] = constants["k3"] / constants["b5"]
    return [_row(name, unit, printed, constants[name], note) for name, unit, printed, note in _PRINTED_CONSTANTS]


def _row(name: str, unit: str, printed: str, computed: float, note: str) -> PrintedRow:
    value = float(printed)
    half_digit = 0.5 * 10.0 ** -len(printed.partition(".")[2])
    error = abs(computed - value)
    verdict: Verdict = "wrong"
    if error <= max(AGREES * abs(computed), half_digit):
        verdict = "agrees"
    elif error <= NEAR * abs(computed):
        verdict = "near"
    return PrintedRow(name=name, unit=unit, printed=value, computed=computed, verdict=verdict, note=note)


def load_table() -> list[PrintedRow]:
    """Return the parameters of link 6 with the largest payload, as printed and as computed.

    Source:
        TR-83-008, appendix II (4).
    """
    link = loaded_arm().links[-1]
    tensor = body_of(link).tensor
    return [
        _row("m6", "kg", "2.31", link.mass, ""),
        _row("y6", "m", "0.0014", float(link.com[1]), "that of the empty hand, which the load brings to the axis"),
        _row("z6", "m", "-0.0203", float(link.com[2]), "cut, not rounded"),
        _row("I6 xx", "kg m²", "0.006", tensor[0][0], "cut, not rounded: 0.0067"),
        _row("I6 yy", "kg m²", "0.006", tensor[1][1], "cut, not rounded: 0.0067"),
        _row("I6 zz", "kg m²", "0.002", tensor[2][2], ""),
    ]


@attrs.frozen(kw_only=True)
class FormRow:
    """The residual of a form of D11 that is fitted to the arm.

    Attributes:
        form: the formula.
        residual: root mean square residual [kg m²].
        share: residual relative to the standard deviation of D11 over the configurations.
    """

    form: str
    residual: float
    share: float


def form_table() -> list[FormRow]:
    """Return the residuals of D11 with and without the square of sin q2, which the report omits.

    Source:
        TR-83-008, appendix III.
    """
    q = fit_configurations()
    D11 = mass_matrix(study_arm(), q)[:, 0, 0]
    s2, q3, c5 = np.sin(q[:, 1]), q[:, 2], np.cos(q[:, 4])
    boom = np.stack([np.ones_like(q3), q3, q3 * c5, q3**2], axis=1)
    forms = {
        "b1 + (b2 + b3 + b5 c5) q3 + b4 q3²": boom,
        "b1 + s2² (b2 + (b3 + b5 c5) q3 + b4 q3²)": np.column_stack([np.ones_like(q3), s2[:, None] ** 2 * boom]),
    }
    rows = []
    for form, columns in forms.items():
        residuals = D11 - columns @ np.linalg.lstsq(columns, D11, rcond=None)[0]
        residual = math.sqrt(float(np.mean(residuals**2)))
        rows.append(FormRow(form=form, residual=residual, share=residual / float(np.std(D11))))
    return rows
