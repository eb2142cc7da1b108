"""Arm files written by us: read back they are equal arms."""

import math
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.arm.write import toml_text
from armwright.errors import InvalidValueError
from oracles.arms import random_arm, squared
from oracles.catalogue import FEW, NAMES
from samples import examples


@pytest.fixture
def back(tmp_path: Path) -> Callable[[Arm], Arm]:
    """Write an arm into an arm file and read it back."""

    def there_and_back(arm: Arm) -> Arm:
        (tmp_path / "arm.toml").write_text(toml_text(arm), encoding="utf-8")
        return load_arm(tmp_path / "arm.toml")

    return there_and_back


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue(name: str, back: Callable[[Arm], Arm]) -> None:
    """Every arm of the catalogue comes back equal, every number to the last bit."""
    assert back(load_arm(name)) == load_arm(name)


@pytest.mark.parametrize("built", [False, True])
def test_random_arms(*, built: bool, rng: np.random.Generator, back: Callable[[Arm], Arm]) -> None:
    """Arms with any base, tool, gravity, bodies and drives come back equal."""
    for joints in range(1, 10):
        arm = random_arm(rng, joints)
        arm = attrs.evolve(squared(arm, rng) if built else arm, reach=rng.uniform(), tool_speed=rng.uniform())

        assert back(arm) == arm


positive = st.floats(1e-99, 1e99)
bound = st.one_of(st.just(math.inf), positive)
# An arm file does not take limits of a revolute joint beyond a thousand turns.
turned = st.one_of(st.just(math.inf), st.floats(1e-99, 6000.0))
number = st.floats(-1e99, 1e99)
angle = st.floats(-1e12, 1e12)


@settings(max_examples=examples(100), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    joint=st.builds(
        Joint,
        kind=st.sampled_from(("revolute", "prismatic")),
        theta=angle,
        d=number,
        a=number,
        alpha=angle,
        limits=st.builds(
            Limits, lower=turned.map(lambda x: -x), upper=turned, speed=bound, acceleration=bound, effort=bound
        ),
    ),
    motor=st.builds(
        Motor,
        inertia=positive,
        viscous=positive,
        coulomb_forward=positive,
        coulomb_backward=positive,
        gear_ratio=positive,
        stiffness=st.one_of(st.just(math.inf), st.floats(1e-3, 1e12)),
        damping=positive,
    ),
    texts=st.tuples(*[st.text(st.characters(exclude_categories=["Cs"]))] * 3),
)
def test_any_numbers_and_texts(
    joint: Joint, motor: Motor, texts: tuple[str, str, str], back: Callable[[Arm], Arm]
) -> None:
    """Numbers of any size, limits known or not, and texts of any characters come back as they were."""
    name, title, source = texts
    arm = Arm(name=name, title=title, source=source, joints=[joint], motors=[motor])

    assert back(arm) == arm


def test_what_is_left_out() -> None:
    """An arm of one plain joint is a file of three lines."""
    assert toml_text(Arm(name="plain", joints=[Joint(kind="revolute")])).split("\n") == [
        'name = "plain"',
        "",
        "[[joint]]  # 1",
        'kind = "revolute"',
        "",
    ]


def test_what_an_arm_file_cannot_hold() -> None:
    """A tensor of which not all moments are known, and a gear that turns the other way, are refused by name."""
    joints = [Joint(kind="revolute")]
    half_known = Link(inertia=np.diag((0.0, 1.0, 3.0)), complete=False)

    with pytest.raises(
        InvalidValueError, match=r"arm 'odd': link 1 has the inertia .* of which not all moments are known"
    ):
        toml_text(Arm(name="odd", joints=joints, links=[half_known]))
    with pytest.raises(
        InvalidValueError, match="arm 'odd': joint 1 has the gear ratio -50; an arm file needs one above 0"
    ):
        toml_text(Arm(name="odd", joints=joints, motors=[Motor(gear_ratio=-50)]))


def test_a_file_name_that_is_no_text(back: Callable[[Arm], Arm]) -> None:
    """Bytes of a file name that are no UTF-8, which Python keeps as half characters, do not spoil the file."""
    assert back(attrs.evolve(load_arm("puma560"), source="a\udcff.urdf")).source == "a\\udcff.urdf"
