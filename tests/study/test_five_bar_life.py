"""The study of a life of the thesis' arms: every point of section 6.2 has numbers that hang together."""

import numpy as np
import pytest

from armwright.study.five_bar_life import GOALS, LIMITS, FiveBarLife


@pytest.fixture(scope="module")
def study() -> FiveBarLife:
    """A short one: a path, few steps and lives."""
    told: list[tuple[str, float]] = []
    short = {"paths": ("x5",), "steps": 2, "lives": 2, "samples": 10}
    found = FiveBarLife.run(lambda task, part: told.append((task, part)), **short)
    assert told[-1] == ("simulated lives", 1.0)
    return found


def test_tables(study: FiveBarLife) -> None:
    """The tables follow the points of the thesis."""
    titles = [table.title for table in study.tables()]
    assert [title[:5] for title in titles] == ["6.2-2", "6.2-3", "6.2-3", "6.2-4", "6.2-5", "6.2-6"]
    assert [*study.as_data()] == ["6.2-2", "6.2-3", "6.2-4 and 5", "6.2-6"]
    assert len([*study.headline()]) == 5
    assert {drawing.name for drawing in study.figures()} == {"paths", "budget", "lives"}


def test_budget(study: FiveBarLife) -> None:
    """Clearances shift the tip by what the thesis prints at its first two goals; rods of steel bend much less."""
    budget = {row.cause: row.errors * 1e3 for row in study.budget}

    np.testing.assert_allclose(budget["mean clearances"][:2], (0.562, 0.569), atol=6e-4)
    assert all(errors.shape == (len(GOALS),) for errors in budget.values())
    assert (budget["elastic rods"] < 1e-3 * budget["mean clearances"]).all()


def test_arms(study: FiveBarLife) -> None:
    """Arm A, nearer to its goals when new, outlives B, of which the thesis says that it is the worse one."""
    a, b = (study.arms[name].lives for name in "AB")

    for mine, other in zip(a, b, strict=True):
        assert mine.quantile(0.1) > other.quantile(0.1) > 0
    np.testing.assert_allclose(a[0].values(np.array([a[0].quantile(0.5)]))[1], LIMITS[0], rtol=0.01)
