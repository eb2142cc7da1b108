"""Natural frequencies on contacts: a closed form, and the free vibration of simulated linkages."""

import attrs
import numpy as np
import pytest

from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Load, Pin
from armwright.clearance.paths import Path, thesis_path
from armwright.clearance.scenario import assembly_guess, close_pins_along, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import simulate
from armwright.clearance.vibration.contact_modes import contact_modes
from armwright.errors import InvalidValueError

CLEARANCE, FORCE, MASS, CARRIED = 2e-4, 25.0, 1.3, 0.4


def hanging(force: float) -> Linkage:
    """A sleeve that hangs on a shaft; beside it slides a carriage, which takes no part up and down."""
    return Linkage(
        name="hanging",
        ground=Body(name="ground", points={"O": (0, 0)}),
        bodies=[
            Body(name="shaft", mass=1.0, inertia=1e-4, points={"O": (0, 0)}),
            Body(name="carriage", mass=CARRIED, points={"O": (0, 0)}),
            Body(name="sleeve", mass=MASS, points={"O": (0, 0)}),
        ],
        joints=[
            Pin(body="shaft", point="O", on=BodyPoint("ground", "O")),
            Guide(body="carriage", point="O", on=BodyPoint("ground", "O")),
            Guide(body="sleeve", point="O", on=BodyPoint("carriage", "O"), direction=np.pi / 2),
        ],
        pins=[
            ClearancePin(
                name="bush",
                bearing=BodyPoint("sleeve", "O"),
                journal=BodyPoint("shaft", "O"),
                clearance=CLEARANCE,
                journal_radius=0.01,
            )
        ],
        drives=[Drive(body="shaft", kind="motion")],
        loads=[Load(point=BodyPoint("sleeve", "O"), force=(0, -force))],
        gravity=(0, 0),
        tip=BodyPoint("sleeve", "O"),
    )


def test_a_sleeve_on_a_shaft() -> None:
    """Up and down it vibrates on the slope of the Hertz force; sideways it swings like a pendulum of the gap."""
    linkage = hanging(FORCE)
    modes = contact_modes(linkage, np.zeros((1, 3)))

    K = float(contact_stiffness(linkage, np.array([CLEARANCE]))[0])
    depth = (FORCE / K) ** (2 / 3)
    slope = 1.5 * K * depth**0.5
    swing, press = np.sqrt(FORCE / (CLEARANCE + depth) / (MASS + CARRIED)), np.sqrt(slope / MASS)
    np.testing.assert_allclose(modes.frequencies, [[swing / (2 * np.pi), press / (2 * np.pi)]], rtol=1e-8)
    np.testing.assert_allclose(modes.stiffness, [[slope]], rtol=1e-8)
    np.testing.assert_allclose(modes.depths, [[depth]], rtol=1e-8)
    # Carriage and sleeve, of unit energy; the shaft is held.
    np.testing.assert_allclose(np.abs(modes.shapes[0, :, 0]), [0, (MASS + CARRIED) ** -0.5, 0], atol=1e-6)
    np.testing.assert_allclose(np.abs(modes.shapes[0, :, 1]), [0, 0, MASS**-0.5], atol=1e-6)


def test_nothing_presses() -> None:
    with pytest.raises(InvalidValueError, match="pin bush of hanging carries no force"):
        contact_modes(hanging(0.0), np.zeros((1, 3)))


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("mode", [3, 4, 5])
def test_free_vibration(five_bar: Linkage, mode: int) -> None:
    """A five-bar let go in the shape of a mode, without friction and loss, swings through half a period as a cosine."""
    path = thesis_path("y1")
    place = path.evaluate([0.125]).position
    q = close_pins_along(five_bar, place, assembly_guess(five_bar), by_tip=True)
    modes = contact_modes(five_bar, q)
    period, shape = 1 / modes.frequencies[0, mode], modes.shapes[0, :, mode]
    # Much less than the indentations, of a third of a micrometre.
    amplitude = 1e-10 / np.abs(shape).max()
    still = Path(name="still", knots=np.array([0.0, period / 2]), pieces=place[:, :, None])
    locked = [attrs.evolve(drive, kind="motion") for drive in five_bar.drives]
    material = attrs.evolve(five_bar.material, restitution=1.0)
    scenario = prepare_scenario(
        attrs.evolve(five_bar, drives=locked, material=material),
        still,
        Settings(step=period / 1000, sample=period / 8),
        guess=q[0],
    )

    run = simulate(scenario, frictions=0.0, initial=(modes.q[0] + amplitude * shape, np.zeros(len(shape))))

    swung = (run.q - modes.q[0]) @ shape / (shape @ shape) / amplitude
    np.testing.assert_allclose(swung, np.cos(2 * np.pi * run.time / period), atol=1e-3)
    other = run.q - modes.q[0] - amplitude * swung[:, None] * shape
    assert np.abs(other).max() < 2e-3 * 1e-10
