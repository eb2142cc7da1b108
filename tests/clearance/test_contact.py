"""The laws of one contact: what an impact loses, how stiff a journal in its bearing is, how surfaces rub."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from armwright.clearance.contact import (
    IMPACT_LAWS,
    Bristles,
    damping,
    elastic_force,
    exact_damping,
    exp_negative,
    largest_indentation,
    linear_slip,
    normal_force,
    restitution_of_damping,
    smooth_slip,
    stiffness,
)
from armwright.errors import InvalidValueError, UnknownNameError

# A blow in numbers of everyday: half a kilogram at 0.3 m/s on steel.
MASS, K, SPEED = 0.5, 7e10, 0.3
# What SciPy's integration of a blow leaves.
INTEGRATED = 1e-7
# Restitutions asked for, and those that the laws give back, to the three digits of the spec's table (2.2), which are
# worked out of the closed form by hand.
REQUESTED = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
GIVEN_BACK = {
    "hunt-crossley": (0.516, 0.547, 0.581, 0.620, 0.663, 0.712, 0.768, 0.833, 0.909, 0.952),
    "lankarani-nikravesh": (0.665, 0.672, 0.684, 0.702, 0.725, 0.756, 0.796, 0.847, 0.913, 0.954),
    "lee-wang": (0.687, 0.712, 0.739, 0.768, 0.799, 0.833, 0.869, 0.909, 0.952, 0.976),
    "herbert-mcwhannell": (0.491, 0.501, 0.520, 0.550, 0.594, 0.651, 0.723, 0.807, 0.901, 0.950),
    "gonthier": (0.101, 0.205, 0.304, 0.398, 0.488, 0.577, 0.670, 0.768, 0.876, 0.936),
    "flores": (0.069, 0.156, 0.256, 0.363, 0.470, 0.577, 0.683, 0.789, 0.894, 0.947),
    "hu-guo": (0.074, 0.166, 0.271, 0.380, 0.488, 0.594, 0.697, 0.799, 0.900, 0.950),
    "carvalho-martins": (0.129, 0.212, 0.304, 0.401, 0.500, 0.600, 0.700, 0.800, 0.900, 0.950),
    "exact": REQUESTED,
}


def blow(chi: float) -> tuple[float, float, float]:
    """What SciPy finds of a blow: restitution, depth, duration."""

    def rates(_t: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], -normal_force(y[0], y[1], SPEED, K, chi) / MASS

    def out(_t: float, y: np.ndarray) -> float:
        return float(y[0])

    def turned(_t: float, y: np.ndarray) -> float:
        return float(y[1])

    out.terminal, out.direction = True, -1  # type: ignore[attr-defined]
    depth = (1.25 * MASS * SPEED**2 / K) ** 0.4
    solution = solve_ivp(
        rates, (0.0, 20 * depth / SPEED), (1e-30, SPEED), method="DOP853", events=(out, turned), rtol=1e-11, atol=1e-18
    )
    return -solution.y_events[0][0][1] / SPEED, solution.y_events[1][0][0], solution.t_events[0][0]


@pytest.mark.parametrize("law", IMPACT_LAWS)
def test_laws_of_the_papers_give_back_what_the_table_says(law: str) -> None:
    """Asked for 0.1 to 0.95, the laws give back what the closed form says of their χ: some of them much more."""
    result = [restitution_of_damping(damping(law, e)) for e in REQUESTED]

    np.testing.assert_allclose(result, GIVEN_BACK[law], rtol=0, atol=5.1e-4)


@pytest.mark.parametrize("law", ["lankarani-nikravesh", "hu-guo", "exact"])
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
def test_closed_form_is_the_motion(law: str, restitution: float) -> None:
    """A mass that SciPy lets fall into the wall comes back with the restitution and from the depth of the formulas."""
    chi = damping(law, restitution)

    e, depth, _ = blow(chi)

    assert restitution_of_damping(chi) == pytest.approx(e, rel=INTEGRATED)
    assert largest_indentation(MASS, K, SPEED, chi) == pytest.approx(depth, rel=INTEGRATED)


def test_time_of_an_elastic_blow() -> None:
    """Without loss a blow lasts as long as SciPy finds, 2.94328 δ_max / v."""
    _, depth, time = blow(0.0)

    assert time == pytest.approx(2.94328 * depth / SPEED, rel=1e-5)


def test_damping_fades_smoothly() -> None:
    """A blow with next to no damping is as deep as one with none."""
    without = largest_indentation(MASS, K, SPEED, 0.0)

    for chi in (1e-9, 0.9e-6, 1.1e-6, 1e-5):
        assert largest_indentation(MASS, K, SPEED, chi) == pytest.approx(without, rel=chi + 1e-9)


@pytest.mark.parametrize(
    ("restitution", "chi"),
    [
        (0.2, 4.91917),
        (0.3, 3.08708),
        (0.4, 2.08250),
        (0.5, 1.43275),
        (0.6, 0.974872),
        (0.8, 0.373146),
        (0.95, 0.0789266),
    ],
)
def test_exact_damping(restitution: float, chi: float) -> None:
    """The χ of which 0.5 comes is 1.43275, and so on to six digits."""
    assert exact_damping(restitution) == pytest.approx(chi, rel=5e-6)


@pytest.mark.parametrize("chi", [0.0, 1e-15, 1e-9, 0.9e-6, 1.1e-6, 1e-5])
def test_next_to_no_damping(chi: float) -> None:
    """A little damping takes two thirds of itself from the rebound."""
    assert 1 - restitution_of_damping(chi) == pytest.approx(2 * chi / 3, rel=1e-3, abs=1e-15)


@pytest.mark.parametrize("restitution", [1e-3, 1e-2, 0.02, 0.03, 0.5, 0.999, 1 - 1e-6])
def test_exact_damping_and_restitution_undo_one_another(restitution: float) -> None:
    """From a restitution to χ and back there is no loss, at the ends of the range too."""
    assert restitution_of_damping(exact_damping(restitution)) == pytest.approx(restitution, rel=1e-7)


def test_no_loss_needs_no_damping() -> None:
    """At a restitution of 1 every law has χ = 0."""
    assert {damping(law, 1.0) for law in IMPACT_LAWS} == {0.0}


@pytest.mark.parametrize("restitution", [0.0, -0.1, 1.1, math.nan])
def test_restitutions_that_cannot_be(restitution: float) -> None:
    """A blow gives back some of its speed, and not more than it had."""
    with pytest.raises(InvalidValueError, match="restitution: expected a number above 0, at most 1, got"):
        damping("flores", restitution)


def test_unknown_law() -> None:
    """A law that nobody wrote is refused with the nearest one."""
    with pytest.raises(UnknownNameError, match=r"no law of impact 'florez'. Did you mean 'flores'\?"):
        damping("florez", 0.9)


@pytest.mark.parametrize(
    ("clearance_mm", "by_hand"),
    [(0.1, 1.5240e11), (0.171, 1.1696e11), (0.25, 9.7102e10), (0.328, 8.5096e10), (0.483, 7.0649e10), (0.5, 6.9494e10)],
)
def test_stiffness_of_steel(clearance_mm: float, by_hand: float) -> None:
    """K of a 10 mm journal of steel falls from 1.5e11 to 0.7e11 as the clearance grows from 0.1 to 0.5 mm."""
    assert stiffness(clearance_mm * 1e-3, 0.01, 207e9, 0.3) == pytest.approx(by_hand, rel=5e-5)


def test_stiffness_of_the_slider_crank() -> None:
    """A 9.5 mm journal in a 10 mm bearing has K = 6.6102e10, as in the papers on that mechanism."""
    assert stiffness(5e-4, 0.0095, 207e9, 0.3) == pytest.approx(6.6102e10, rel=5e-5)


@pytest.mark.parametrize(("clearance_mm", "depth_um"), [(0.1, 0.163), (0.25, 0.220), (0.328, 0.240), (0.5, 0.275)])
def test_depth_of_ten_newtons(clearance_mm: float, depth_um: float) -> None:
    """Ten newtons press the journal less than a third of a micrometre into the wall."""
    K_of = float(stiffness(clearance_mm * 1e-3, 0.01, 207e9, 0.3))

    depth = brentq(lambda d: elastic_force(d, K_of) - 10.0, 0.0, 1e-5, xtol=1e-16)
    assert depth * 1e6 == pytest.approx(depth_um, abs=6e-4)


@pytest.mark.parametrize("clearance", [0.0, -1e-4, [1e-4, 0.0]])
def test_no_play_has_no_stiffness(clearance: object) -> None:
    """The law divides by the clearance."""
    with pytest.raises(InvalidValueError, match="clearance: contact needs clearances above 0, got"):
        stiffness(clearance, 0.01, 207e9, 0.3)  # type: ignore[arg-type]


def test_walls_push_and_never_pull() -> None:
    """A journal that flies feels nothing, nor one that leaves faster than its wall can follow."""
    assert normal_force(-1e-6, 1.0, 1.0, K, 0.1) == 0.0
    assert normal_force(1e-6, -11.0, 1.0, K, 0.1) == 0.0
    assert normal_force(1e-6, -9.0, 1.0, K, 0.1) == pytest.approx(0.1 * K * 1e-9)


class TestSliding:
    """How the friction of dry surfaces depends on the speed of sliding."""

    def test_straight_line(self) -> None:
        """Below the threshold friction grows along a straight line, above it is full, opposing both directions."""
        speeds = np.array((-5.0, -1.0, -0.25, 0.0, 0.5, 1.0, 3.0))

        np.testing.assert_allclose(linear_slip(speeds, 1.0), (-1, -1, -0.25, 0, 0.5, 1, 1), atol=1e-15)

    def test_smooth_curve(self) -> None:
        """The smooth law is the hyperbolic tangent."""
        speeds = np.linspace(-30.0, 30.0, 401)

        np.testing.assert_allclose(smooth_slip(speeds, 1.3), np.tanh(speeds / 1.3), rtol=0, atol=1e-12)

    def test_falling_exponential(self) -> None:
        """exp(-x) is good to 13 digits up to 20, and never a wild number beyond."""
        x = np.linspace(0.0, 20.0, 301)
        np.testing.assert_allclose(exp_negative(x), np.exp(-x), rtol=2e-13)
        assert 0.0 <= exp_negative(np.array([1e3, 1e300]))[0] < 1e-290


class TestBristles:
    """The LuGre law."""

    FRICTION = 0.1

    @pytest.mark.parametrize("speed", [-0.5, -2e-3, -1e-4, 1e-5, 1e-3, 0.1])
    def test_steady_sliding(self, speed: float) -> None:
        """At a steady speed friction is that of Stribeck's curve and of the oil: g(v) sgn v + σ2 v."""

        def rate(bend: float) -> float:
            return float(Bristles.step(bend, speed, self.FRICTION)[1])

        bend = brentq(rate, -1e-5, 1e-5, xtol=1e-18, rtol=1e-15)

        ratio = speed / Bristles.stribeck
        curve = self.FRICTION * (1 + (Bristles.static_ratio - 1) * math.exp(-(ratio**2)))
        want = math.copysign(curve, speed) + Bristles.viscosity * speed
        assert Bristles.step(bend, speed, self.FRICTION)[0] == pytest.approx(want, rel=1e-9)

    def test_what_is_held_springs_back(self) -> None:
        """Before it slides the contact is a spring: 1 µm of bending is 0.1 of the normal force."""
        coefficient, rate = Bristles.step(1e-6, 0.0, self.FRICTION)

        assert coefficient == pytest.approx(Bristles.stiffness * 1e-6)
        assert rate == 0.0

    def test_nothing_to_lean_on(self) -> None:
        """Without friction there are no brushes."""
        assert Bristles.step(1e-6, 0.3, 0.0) == (0.0, 0.0)
