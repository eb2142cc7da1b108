"""``armwright clearance tolerance`` from the outside."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright, check_mistake

FILE = Path(__file__).parents[2] / "examples" / "five_bar_tolerances.toml"
GOAL = ("--pose=-180,-600",)


def test_of_poses(tmp_path: Path) -> None:
    """Poses have means, bounds, probabilities and shares; the page has its figures and what looks alike."""
    done = armwright(
        *("clearance", "tolerance", "five-bar", FILE, *GOAL, "--pose", "0,-575", "--limit", "0.08"),
        *("--allocate", "worst-case", "--samples", "2", "--json", "-o", tmp_path / "out"),
    )

    data = json.loads(done.stdout)
    assert data["linkage"] == "five-bar"
    assert data["poses"][1]["tip_m"] == pytest.approx([0.0, -0.575])
    for pose in data["poses"]:
        assert 0 < pose["mean_m"] < pose["statistical_m"] < pose["worst_case_m"]
    assert sum(one["share"] for one in data["dimensions"]) == pytest.approx(1)
    assert 0 < data["on_path"]["probability"] < 0.1
    assert data["nonlinearity"] < 0.01
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("report.html", "tolerance.json", "run.json", "errors.svg", "shares.svg", "costs.svg")
    }
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Play in J2 moves the tip as the length of link2 does" in page


def test_of_a_table_corrected(tmp_path: Path) -> None:
    """Of a corrected path only deviations from the mean linkage count."""
    (tmp_path / "poses.csv").write_text("x_mm,y_mm\n-180,-600\n180,-600\n", encoding="utf-8")

    done = armwright(
        *("clearance", "tolerance", "five-bar", FILE, "--csv", "poses.csv", "--corrected", "--samples", "2", "--json"),
        cwd=tmp_path,
    )

    assert [pose["mean_m"] for pose in json.loads(done.stdout)["poses"]] == [0, 0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("five-bar", *GOAL), "expected a file of tolerances: a linkage such as five-bar has none of its own"),
        (("five-bar", str(FILE)), "expected the poses, as --pose X,Y, --path NAME or --csv FILE"),
        (("five-bar", str(FILE), *GOAL, "--path", "y1"), "expected the poses, as"),
        (("five-bar", str(FILE), "--path", "y99"), "no path 'y99'"),
        (("five-bar", str(FILE), "--pose", "5"), "expected 2 finite numbers"),
        (("five-bar", str(FILE), "--pose", "0,0"), "cannot be followed"),
        (("five-bar", str(FILE), *GOAL, "--limit", "0.01", "--allocate", "worst-case"), "more than the mean error"),
        (("five-bar", str(FILE), *GOAL, "--allocate", "worst-case"), "specify --limit MM"),
        (("four-bar", str(FILE), "--pose", "5"), "clearances_mm, J3: unknown key"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], said: str, tmp_path: Path) -> None:
    """What is missing or cannot be gives one clear error."""
    check_mistake("clearance", "tolerance", *options, said=said, folder=tmp_path)
