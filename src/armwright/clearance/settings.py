"""The settings of a simulation with clearance, and the check of its step against the contacts."""

from __future__ import annotations

from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, not_negative, positive
from armwright.clearance.contact import FRICTION_LAWS, IMPACT_LAWS, ImpactLaw, largest_indentation, stiffness
from armwright.clearance.equations import SLIP_SPEEDS, FrictionModel
from armwright.clearance.kernel import CONTROLS, INTEGRATORS, Control, Integrator
from armwright.clearance.linkage import Linkage
from armwright.errors import InvalidValueError, one_of

Start: TypeAlias = Literal["rest", "rigid", "centred"]
STARTS: tuple[Start, ...] = ("rest", "rigid", "centred")

# The force of a typical contact at rest [N], and the largest step times its angular frequency.
_USUAL_FORCE, _LARGEST_PART = 20.0, 0.7
# A path of more steps has a mistaken unit.
_MAX_STEPS = 20_000_000


@attrs.frozen(kw_only=True)
class Settings:
    """The settings of a simulation with clearance.

    Attributes:
        step: of the integrator [s].
        integrator: ``rk4`` or ``semi-implicit``.
        control: ``effort``, the drives give the efforts of the ideal linkage; ``pd+ff``, plus a controller's.
        gains: of the controller, stiffness [N m/rad] and damping [N m s/rad]; of a drive with prescribed motion they
            add to its acceleration [1/s², 1/s].
        impact: law of the loss in an impact.
        friction: the friction model.
        threshold: sliding speed below which friction fades [m/s].
        start: at ``rest`` on elastic walls, at rest on ``rigid`` walls, or with ``centred`` journals.
        sample: time between samples [s]; rounded to whole steps.
        located: whether a step with an impact is made in two parts, so that the impact speed is taken at the impact
            and not up to a step later.
    """

    step: float = 1e-5
    integrator: Integrator = "rk4"
    control: Control = "effort"
    gains: tuple[float, float] = (200.0, 10.0)
    impact: ImpactLaw = "lankarani-nikravesh"
    friction: FrictionModel = attrs.field(factory=FrictionModel)
    threshold: float = 1e-3
    start: Start = "rest"
    sample: float = 1e-4
    located: bool = False

    def __attrs_post_init__(self) -> None:
        """Check names and ranges."""
        for what in ("step", "threshold", "sample"):
            positive(getattr(self, what), what)
        if len(self.gains) != 2:
            raise InvalidValueError(f"gains: expected stiffness and damping, got {len(self.gains)} numbers")
        for gain in self.gains:
            not_negative(gain, "gains")
        one_of("integrator", self.integrator, INTEGRATORS)
        one_of("control", self.control, CONTROLS)
        one_of("law of impact", self.impact, IMPACT_LAWS)
        one_of("law of friction", self.friction.law, FRICTION_LAWS)
        one_of("sliding speed", self.friction.velocity, SLIP_SPEEDS)
        one_of("start", self.start, STARTS)

    def steps(self, duration: float) -> int:
        """Return how many equal steps a duration [s] takes.

        Raises:
            InvalidValueError: they are more than the limit.
        """
        count = duration / self.step - 1e-9
        steps = max(1, int(np.ceil(min(count, 2.0 * _MAX_STEPS))))
        if steps > _MAX_STEPS:
            raise InvalidValueError(
                f"{duration:g} s would take {count:.3g} steps of {self.step:g} s; at most {_MAX_STEPS:,} are made"
            )
        return steps


def contact_stiffness(linkage: Linkage, clearances: Array) -> Array:
    """Return K of each pin [N/m^1.5] for clearances (..., p) [m].

    Raises:
        InvalidValueError: a clearance is not above 0.
    """
    material = linkage.material
    K = np.zeros_like(clearances)
    for i, pin in enumerate(linkage.pins):
        K[..., i] = stiffness(clearances[..., i], pin.journal_radius, material.young, material.poisson)
    return K


def check_step(linkage: Linkage, settings: Settings, K: Array) -> None:
    """Refuse a step that is too long for the contacts.

    A contact under load oscillates with ω² = k / m, where k is the slope of the Hertz force at that load and m the
    lighter side. Runge-Kutta and the semi-implicit rule are stable while ω h stays below 2 to 2.8, and accurate at a
    third of that.

    Args:
        linkage: with p pins.
        settings: with the step.
        K: (..., p) stiffness of the contacts [N/m^1.5].

    Raises:
        InvalidValueError: the step is too long.
    """
    if K.size > 0:
        lightest = min(body.mass for body in linkage.bodies) / 2
        slope = _usual_slope(float(K.max()))
        longest = _LARGEST_PART / np.sqrt(slope / lightest)
        if settings.step > longest:
            depth = largest_indentation(lightest, float(K.max()), 1.0, 0.0)
            raise InvalidValueError(
                f"step: {settings.step:g} s is too long for contacts of {K.max():.3g} N/m^1.5, which oscillate in "
                f"{2 * np.pi * np.sqrt(lightest / slope):.2g} s and stop a blow of 1 m/s within {depth * 1e6:.0f} µm; "
                f"expected at most {_round_down(float(longest)):g} s"
            )
    for name, rod in linkage.rods.items():
        contacts = [
            # The other side of a contact may be as light.
            (2 * _usual_slope(float(K[..., i].max())), rod.section_at(linkage.point(end)))
            for i, pin in enumerate(linkage.pins)
            for end in (pin.bearing, pin.journal)
            if end.body == name
        ]
        fastest = rod.fastest_vibration(contacts)
        if settings.step * fastest > _LARGEST_PART:
            raise InvalidValueError(
                f"step: {settings.step:g} s is too long for elastic body {name}, whose fastest shape vibrates in "
                f"{2 * np.pi / fastest:.2g} s; expected at most {_round_down(_LARGEST_PART / fastest):g} s"
                f"{', or fewer modes' if len(rod.frequencies) > 1 else ''}"
            )


def _usual_slope(K: float) -> float:
    """Return the slope of the force of a typical contact [N/m]."""
    return float(1.5 * K ** (2 / 3) * _USUAL_FORCE ** (1 / 3))


def _round_down(seconds: float) -> float:
    """Return a time with two digits that is not longer than another."""
    unit = 10.0 ** (np.floor(np.log10(max(seconds, np.finfo(float).tiny))) - 1)
    return float(np.floor(seconds / unit) * unit)
