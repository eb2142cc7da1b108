"""The summary of trials: shares with their intervals, errors, causes, and its files."""

import json
import re

import numpy as np
import pytest
from scipy.stats import binomtest

from armwright.report.trials_files import trials_files
from armwright.report.trials_summary import Trial, TrialsSummary, trial, wilson_interval

NAN = float("nan")


@pytest.mark.parametrize(
    ("successes", "trials"), [(0, 1), (1, 1), (0, 200), (200, 200), (1, 30), (190, 200), (95, 100)]
)
def test_wilson_intervals_are_those_of_scipy(successes: int, trials: int) -> None:
    expected = binomtest(successes, trials).proportion_ci(method="wilson")
    assert wilson_interval(successes, trials) == pytest.approx((expected.low, expected.high), abs=1e-12)


def _summary() -> TrialsSummary:
    """Seven good trials out of ten, with errors of 0.1 to 0.7 mm; one is misplaced, one has an error, one died."""
    good = [Trial(number, "", "", number * 1e-4, 0.01, 4.0, ended=True) for number in range(1, 8)]
    bad = [
        trial(8, "misplaced: BLOCK is 9 mm away", {"distance": 9e-3, "angle": 0.1, "duration": 4.0, "ended": 1.0}),
        trial(9, "R603: closed: on nothing", {"distance": 0.2, "angle": 0.0, "duration": 2.0, "ended": 0.0}),
        trial(10, "the worker process died", {"distance": NAN, "angle": NAN, "duration": NAN, "ended": NAN}),
    ]
    return TrialsSummary(program="stack.rlo", cell="bench", seed=1, trials=(*good, *bad))


def test_data_of_a_summary() -> None:
    data = _summary().as_data()
    assert (data["trials"], data["successes"], data["success"]) == (10, 7, 0.7)
    assert data["interval"] == list(wilson_interval(7, 10))
    assert data["causes"] == {
        "misplaced": {"count": 1, "trials": [8]},
        "R603": {"count": 1, "trials": [9]},
        "killed": {"count": 1, "trials": [10]},
    }
    assert data["failures"][1] == {"trial": 9, "seed": 1, "cause": "R603", "message": "closed: on nothing"}
    # Of the programs that came to their end.
    errors = [*(0.1 * np.arange(1, 8)), 9.0]
    assert data["errors_mm"]["median"] == pytest.approx(np.median(errors))
    assert data["errors_mm"]["p95"] == pytest.approx(np.quantile(errors, 0.95))
    assert data["errors_mm"]["largest"] == pytest.approx(9.0)
    assert sum(data["histogram"]["counts"]) == 8
    assert data["histogram"]["edges_mm"][-1] == pytest.approx(9.0)
    json.dumps(data, allow_nan=False)


def test_numbers_of_a_summary_follow_from_each_trial() -> None:
    """Whoever has the file can compute each number of the summary anew."""
    data = _summary().as_data()
    each = data["each"]
    assert [row["trial"] for row in each] == list(range(1, 11))
    assert sum(row["cause"] is None for row in each) == data["successes"]
    errors = [row["error_mm"] for row in each if row["ended"]]
    assert data["errors_mm"]["p95"] == pytest.approx(np.quantile(errors, 0.95))
    assert data["histogram"]["counts"] == np.histogram(errors, data["histogram"]["edges_mm"])[0].tolist()
    assert (each[-1]["error_mm"], each[-1]["duration_s"]) == (None, None)
    assert _summary().notes[1] == (
        "largest placing errors of a part, in the 8 trials whose program came to its end: "
        "median 0.45 mm and 0.573 deg, 95 % below 6.09 mm and 3.92 deg"
    )


def test_a_summary_without_errors_to_show() -> None:
    failed = trial(1, "R603: nothing", {"distance": 0.1, "angle": 0.0, "duration": 1.0, "ended": 0.0})
    summary = TrialsSummary(program="a", cell="b", seed=0, trials=(failed,))
    data = summary.as_data()
    assert data["errors_mm"] == {"median": None, "p95": None, "largest": None}
    assert sum(data["histogram"]["counts"]) == 0
    assert set(trials_files(summary, command="x")) == {"trials.json", "report.html"}


def test_notes_and_tables_name_what_is_repeated() -> None:
    summary = _summary()
    assert summary.notes[0] == "7 of 10 trials succeed: 70.0%, with 95 % confidence 39.7% to 89.2%"
    assert "--seed 1 --trial 8" in summary.notes[-1]
    causes, failures = summary.tables()
    assert causes.rows[0] == ("misplaced", "1", "10.0%", "8")
    assert failures.rows[1] == ("9", "R603", "closed: on nothing")


def test_files_of_trials() -> None:
    summary = _summary()
    files = trials_files(summary, command="armwright run")
    assert json.loads(files["trials.json"]) == json.loads(json.dumps(summary.as_data()))
    assert "7 of 10 trials succeed" in files["report.html"]
    assert "placing errors" in files["errors.svg"]
    data = summary.as_data()
    assert re.findall(r"<b>([^<]*)</b>", files["report.html"]) == [
        f"{data['success']:.1%}",
        "39.7% to 89.2%",
        f"{data['errors_mm']['median']:.3g} mm",
        f"{data['errors_mm']['p95']:.3g} mm",
    ]
