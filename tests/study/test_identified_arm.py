"""The loop from a drawing to an arm that tracks better, in a cell with physics."""

import pytest

from armwright.study.identified_arm import IdentifiedArm

pytest.importorskip("clarabel", reason="the extra identification is not installed")


def test_identified_arm_tracks_better() -> None:
    """With the identified arm the controller tracks five times as well as with the drawing, nearly as the truth."""
    study = IdentifiedArm.run()

    errors = {name: float((x**2).mean() ** 0.5) for name, x in study.tracking.items()}
    assert errors["identified"] < errors["drawing"] / 5
    assert errors["identified"] < 1.5 * errors["truth"]
    tracking, predicted = study.tables()
    assert [row[0] for row in tracking.rows] == ["drawing", "identified", "truth"]
    assert len(predicted.rows) == 1
    assert len(list(study.headline())) == 4
    assert study.as_data()["known"][1] > 50
    assert [drawing.name for drawing in study.figures()] == ["tracking"]
