"""The page of a calibration in a browser: its view of the residuals, and its layout on a phone."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.calibration.assessment import CalibrationAssessment, assess_calibration
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.measurements import read_measurements
from armwright.report.calibration_files import calibration_files
from armwright.report.calibration_page import residual_view

OFF = 11


@pytest.fixture(scope="module")
def assessment(tmp_path_factory: pytest.TempPathFactory) -> CalibrationAssessment:
    """A PUMA whose base stands askew, measured at 30 points, one of them off."""
    arm, rng = load_arm("puma560"), np.random.default_rng(5)
    chain = kinematic_chain(arm)
    limits = arm.limits
    q = rng.uniform(limits.lower, limits.upper, (30, 6)) * 0.6
    errors = np.where(chain.is_length, 5e-4, 1e-3) * rng.standard_normal(len(chain.names))
    c, s = np.cos(0.7), np.sin(0.7)
    points = chain.forward(q, errors).position @ [[c, s, 0], [-s, c, 0], [0, 0, 1]] + [1.0, 2.0, 0.3]
    points += 5e-5 * rng.standard_normal(points.shape)
    points[OFF, 2] += 6e-4
    head = [*(f"joint_{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm", "name"]
    rows = [
        ",".join([*map(str, [*np.degrees(a), *(p * 1e3)]), f"N{i}"])
        for i, (a, p) in enumerate(zip(q, points, strict=True))
    ]
    path = tmp_path_factory.mktemp("measured") / "points.csv"
    path.write_text("\n".join([",".join(head), *rows]) + "\n", encoding="utf-8")
    return assess_calibration(arm, read_measurements(path, arm), folds=3)


def test_view_of_the_residuals(assessment: CalibrationAssessment) -> None:
    """Points are in the frame of the base; arrows are residuals, magnified as it is said; the odd one is marked."""
    view = residual_view(assessment)

    own = kinematic_chain(assessment.arm).forward(assessment.fitted.q).position
    np.testing.assert_allclose(view["points"], own, atol=0.02)
    lengths = np.linalg.norm(view["arrows"], axis=1) / view["factor"]
    np.testing.assert_allclose(lengths, assessment.full.after.distance)
    # Those of a calibrated arm go every way: in the frame of the base, not of the measurements.
    errors = assessment.full.model.residuals(assessment.fitted, assessment.full.errors).values.reshape(-1, 3)
    base = assessment.full.chain.base[:3, :3]
    np.testing.assert_allclose(np.array(view["arrows"]) @ base.T / view["factor"], errors, atol=1e-12)
    assert view["marked"] == [OFF]
    assert view["said"][OFF].startswith(f"N{OFF}: 0.")


@pytest.mark.browser
def test_page_in_a_browser(browser: Any, assessment: CalibrationAssessment, tmp_path: Path) -> None:
    """The view shows every reading, names the odd one, and is turned by keys; nothing is wider than a phone."""
    file = tmp_path / "report.html"
    file.write_text(calibration_files(assessment, title="A", command="a")["report.html"], encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 800}, color_scheme="dark")
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(file.as_uri())

    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator("#points .reading").count() == 30
    assert page.locator("#points .marked text").inner_html().startswith(f"N{OFF}: 0.")
    before = page.locator("#points").inner_html()
    page.locator("#points").focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#points").inner_html() != before
    # The value of each error is on the screen, and so is its dot.
    rights = page.evaluate("[...document.querySelectorAll('.errors td')].map(td => td.getBoundingClientRect().right)")
    assert max(rights) <= 390
    fills = page.evaluate("[...document.querySelectorAll('svg *')].map(e => getComputedStyle(e).fill)")
    assert "rgb(255, 255, 255)" not in fills
    page.emulate_media(media="print")
    assert not page.locator(".sections").is_visible()
    assert complaints == []
    page.close()


def test_every_part_is_linked(assessment: CalibrationAssessment) -> None:
    """Links lead to the sections and to the files beside the page."""
    files = calibration_files(assessment, title="A", command="a")
    page = files["report.html"]

    assert re.findall(r'<section class="card" id="(part-\d)" aria-label="([^"]*)"', page) == [
        ("part-1", "Summary"),
        ("part-2", "Parameters"),
        ("part-3", "Residuals"),
        ("part-4", "Files"),
    ]
    assert set(re.findall(r'<a href="([^"#]*)" download>', page)) == set(files) - {"report.html"}
