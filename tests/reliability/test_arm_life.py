"""The life of an arm that repeats a motion: components, the arm as a whole, and its repeatability."""

from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.stats import norm

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.errors import FileFormatError, InvalidValueError, ShapeError
from armwright.reliability import (
    ArmLife,
    LifeFile,
    PlayGrowth,
    Rating,
    RepeatedMotion,
    assess_life,
    joint_speed,
    read_life_file,
)
from samples import Sample

EXAMPLE = Path(__file__).parents[2] / "examples" / "puma_life.toml"


def motion(arm: Arm, dwell: float = 0.0) -> RepeatedMotion:
    """Two seconds at constant speed and effort."""
    t = np.linspace(0.0, 2.0, 201)
    qd, tau = np.full((201, arm.n), 0.5), np.full((201, arm.n), 50.0)
    return RepeatedMotion(t=t, q=0.5 * t[:, None] + np.full(arm.n, -0.5), qd=qd, effort=tau, dwell=dwell)


def file(folder: Path, text: str) -> LifeFile:
    """What a file with this text states of a PUMA 560."""
    path = folder / "life.toml"
    path.write_text(text, encoding="utf-8")
    return read_life_file(path, load_arm("puma560"))


def test_components_by_hand() -> None:
    """Half the rated torque at half the rated speed lives sixteen times as long; pauses count; two fail sooner."""
    arm = load_arm("puma560")
    rating = Rating(effort=100.0, speed=1.0, hours=1000.0, average=40.0, peak=60.0)
    stated = LifeFile(ratings={(0, "reducer"): rating, (1, "bearing"): rating}, plays={}, slope=1.5)

    life = assess_life(arm, motion(arm, dwell=2.0), stated)

    # The mean speed over four seconds is a quarter of the rated one.
    assert [one.hours for one in life.components] == pytest.approx([1000 * 4 * 8] * 2)
    assert life.hours == pytest.approx(1000 * 4 * 8 * 2 ** (-1 / 1.5))
    assert life.cycles_of(life.hours) == pytest.approx(life.hours * 3600 / 4)
    assert life.survival(life.hours) == pytest.approx(0.9)
    # The joint holds its load in the pause too.
    assert [one.load.rms_effort for one in life.components] == pytest.approx([50.0] * 2)
    assert life.components[0].exceeded == ("average",)
    assert life.work == pytest.approx(np.full(6, 50.0))
    assert "The motion exceeds ratings: reducer of joint 1 (average); bearing of joint 2 (average)" in life.notes[1]


def test_first_passage_of_a_lognormal_rate() -> None:
    """With one growing play the cycles are lognormal: quantiles are those of its closed form."""
    arm, spread = load_arm("puma560"), 0.5
    stated = LifeFile(ratings={}, plays={1: PlayGrowth(first=0.0, per_cycle=1e-11, spread=spread)})

    life = assess_life(arm, motion(arm), stated, limit=1e-4, samples=20_000, seed=3, most=3)

    assert life.play is not None
    median = life.play.quantile(0.5)
    for part in (0.05, 0.1, 0.9, 0.95):
        expected = np.exp(spread * norm.ppf(part))
        assert life.play.quantile(part) / median == pytest.approx(expected, rel=0.02)
    # The repeatability at the median life is the limit.
    assert life.curve is not None
    cycles, bands = life.curve
    assert np.interp(median, cycles, bands[1]) == pytest.approx(1e-4, rel=0.01)


def test_sensitivities_in_closed_form() -> None:
    """One play p + r N that reaches a width w lives (w - p) / r cycles; scaling all growths scales any life."""
    arm = load_arm("puma560")

    def life(*plays: PlayGrowth) -> ArmLife:
        stated = LifeFile(ratings={}, plays=dict(enumerate(plays)))
        return assess_life(arm, motion(arm), stated, limit=1e-4, samples=1, most=2)

    one = life(PlayGrowth(first=2e-5, per_cycle=1e-11))
    assert one.play is not None
    assert one.sensitivities is not None
    grown = 1e-11 * one.play.quantile(0.5)
    assert one.sensitivities[0] == pytest.approx([1.0, 2e-5 / grown], rel=1e-3)
    assert (one.sensitivities[1:] == 0).all()
    several = life(*(PlayGrowth(first=1e-5, per_cycle=rate) for rate in (2e-11, 1e-11, 3e-11))).sensitivities
    assert several is not None
    assert several[:, 0].sum() == pytest.approx(1, rel=0.01)
    assert (several[:3] > 0).all()


def test_repeatability_counts_at_rest() -> None:
    """Of a motion with stops only these count, one pose each; of one that never stops all do."""
    arm = load_arm("puma560")
    t = np.linspace(0.0, 4.0, 401)
    # Two swings, each from rest to rest, and a stay of a second between them.
    phase = np.pi * (np.clip(t, 0, 1.5) + np.clip(t - 2.5, 0, 1.5)) / 1.5
    moves = ((t < 1.5) | (t > 2.5)) * np.pi / 1.5
    way = RepeatedMotion(
        t=t,
        q=np.outer(1 - np.cos(phase), np.full(6, 0.2)),
        qd=np.outer(np.sin(phase) * moves, np.full(6, 0.2)),
        effort=np.ones((401, 6)),
    )
    stated = LifeFile(ratings={}, plays={1: PlayGrowth(first=1e-5, per_cycle=1e-11)})

    life = assess_life(arm, way, stated, limit=1e-4, samples=10, most=5)

    assert life.resting
    assert len(life.q) == 3
    assert life.q[:, 0] == pytest.approx([0.0, 0.4, 0.0], abs=1e-4)
    assert life.visited_numbers.tolist() == [1, 101, 201, 301, 401]
    moving = assess_life(arm, motion(arm), stated, limit=1e-4, samples=10, most=5)
    assert not moving.resting
    assert len(moving.q) == 5
    assert moving.notes == ("The motion never rests, so the repeatability counts at all of its poses.",)


def test_growth_by_work_and_measurements() -> None:
    """Growth per joule goes with the motion, and measurements move it to what they say."""
    grown = [(n, 2e-5 + 3e-11 * n, 1e-6) for n in (2e5, 4e5, 8e5)]
    play = PlayGrowth(first=2e-5, per_work=1e-12, spread=1.0)

    assert play.rate(10.0) == pytest.approx((1e-11, 1.0))
    updated = PlayGrowth(first=2e-5, per_work=1e-12, spread=1.0, measured=tuple(grown)).rate(10.0)
    assert updated is not None
    assert updated[0] == pytest.approx(3e-11, rel=0.03)
    assert updated[1] < 0.05
    assert PlayGrowth(first=2e-5).rate(10.0) is None


def test_no_cycles_without_a_growth() -> None:
    """Where no growth is known there is no number of cycles, but the poses that would tell it."""
    arm = load_arm("puma560")
    life = assess_life(arm, motion(arm), LifeFile(ratings={}, plays={0: PlayGrowth(first=2e-5)}), limit=1e-4)

    assert life.play is None
    assert life.as_data()["play"] is None
    assert "there is no number of cycles" in life.notes[0]
    assert [table.title for table in life.tables() if table.rows] == ["Where the repeatability tells of a play"]


@pytest.mark.share(0.02)
def test_intervals_of_lives_cover(sample: Sample) -> None:
    """From 5 to 95 % lie the lives of about nine in ten arms, whose plays were measured three times."""
    arm, limit, spread, covered = load_arm("puma560"), 1e-4, 0.5, 0
    way, truth = motion(arm), None
    for rng in sample.cases(3000):
        rate = 1e-11 * np.exp(spread * rng.normal())
        cycles = np.array([1e5, 3e5, 6e5])
        plays = 2e-5 + rate * cycles + 2e-6 * rng.normal(size=3)
        measured = tuple((n, max(play, 0.0), 2e-6) for n, play in zip(cycles, plays, strict=True))
        growth = PlayGrowth(first=2e-5, per_cycle=1e-11, spread=spread, measured=measured)
        stated = LifeFile(ratings={}, plays={1: growth})
        life = assess_life(arm, way, stated, limit=limit, samples=400, most=3, seed=sample.case)
        assert life.play is not None
        if truth is None:
            exact = LifeFile(ratings={}, plays={1: PlayGrowth(first=2e-5, per_cycle=1e-11)})
            one = assess_life(arm, way, exact, limit=limit, samples=1, most=3).play
            assert one is not None
            truth = one.quantile(0.5) * 1e-11
        covered += life.play.quantile(0.05) <= truth / rate <= life.play.quantile(0.95)
    count = sample.count(3000)
    sample.record("lives of arms whose play was measured", count, 0, covered=covered / count)
    assert abs(covered / count - 0.9) < max(0.05, 4 * np.sqrt(0.09 / count))


def test_example() -> None:
    """The file of the example is what it says."""
    stated = read_life_file(EXAMPLE, load_arm("puma560"))

    assert stated.slope == 1.2
    assert stated.ratings[0, "reducer"].speed == pytest.approx(joint_speed(2000, 100))
    assert stated.ratings[1, "bearing"].exponent == pytest.approx(10 / 3)
    assert stated.plays[1].measured[0] == pytest.approx((200_000, 28e-6, 4e-6))
    assert stated.plays[2].per_cycle is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected a reducer, a bearing or a play"),
        ("[joint.7.play]\nfirst_urad = 1", "unknown key"),
        ("[joint.1.gear]\nrated_Nm = 1", "unknown key"),
        ("[joint.1.reducer]\nrated_Nm = 1\nhours = 1", "speed_deg_per_s: missing"),
        ("[joint.1.reducer]\nrated_Nm = 1\nhours = 1\ninput_rpm = 1", "ratio: missing"),
        ("[joint.1.reducer]\nrated_Nm = -1\nhours = 1\nspeed_deg_per_s = 1", "rated_Nm"),
        ("[joint.1.reducer]\nrated_Nm = 1\nhours = 1\nspeed_deg_per_s = 1\nkind = 'ball'", "did you mean 'balls'"),
        ("[joint.1.play]\nfirst_um = 1", "first_um"),
        ("[joint.1.play]\ngrowth_per_cycle_urad = 1\ngrowth_per_J_urad = 1", "not both"),
        ("[joint.1.play]\nmeasured_urad = [[1, 2, 3]]", "expected the growth and its spread"),
        ("[joint.1.play]\ngrowth_per_J_urad = 1\nspread = 1\nmeasured_urad = [[1, 2, 0]]", "an error above 0"),
        ("weibull_slope = 0\n[joint.1.play]\nfirst_urad = 1", "weibull_slope"),
    ],
)
def test_wrong_files(tmp_path: Path, text: str, said: str) -> None:
    """Each is one message with the file and the key."""
    with pytest.raises((FileFormatError, InvalidValueError), match=said):
        file(tmp_path, text)


def test_wrong_arguments() -> None:
    """A limit needs plays, times increase, and rows fit each other."""
    arm = load_arm("puma560")
    way = motion(arm)
    none, some = LifeFile(ratings={}, plays={}), LifeFile(ratings={}, plays={0: PlayGrowth(first=1e-5)})
    with pytest.raises(InvalidValueError, match="needs the play of a joint"):
        assess_life(arm, way, none, limit=1e-4)
    with pytest.raises(InvalidValueError, match="limit"):
        assess_life(arm, way, some, limit=10.0)
    with pytest.raises(InvalidValueError, match="times that increase"):
        attrs.evolve(way, t=way.t[::-1])
    with pytest.raises(ShapeError, match="expected t"):
        attrs.evolve(way, q=way.q[:5])
    with pytest.raises(ShapeError):
        assess_life(load_arm("panda"), way, some)
