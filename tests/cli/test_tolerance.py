"""The command tolerance: its tables, its JSON and its files."""

import json
from pathlib import Path

import numpy as np
import pytest

from cli_calls import armwright

EXAMPLES = Path(__file__).parents[2] / "examples"
TOLERANCES = EXAMPLES / "puma_tolerances.toml"
Q_DEG = "10,-20,30,0,40,0"


def test_of_one_pose() -> None:
    """A pose has a worst case, a statistical error, a probability; shares add up to one; least cost keeps the limit."""
    done = armwright(
        "tolerance", "puma560", TOLERANCES, "-q", Q_DEG, "--limit", "0.2", "--allocate", "worst-case", "--json"
    )
    data = json.loads(done.stdout)

    (pose,) = data["poses"]
    assert pose["worst_case_m"] > pose["statistical_m"] > 0
    assert sum(one["share"] for one in data["dimensions"]) == pytest.approx(1)
    assert pose["probability"] == pytest.approx(data["on_path"]["probability"], rel=0.1)
    assert data["allocation"]["least_cost"] <= data["allocation"]["cost"] <= data["allocation"]["scaled_cost"]
    assert data["nonlinearity"] < 0.1


def test_of_a_path(tmp_path: Path) -> None:
    """Poses of a table have a page with three figures; the table of dimensions names the largest share first."""
    q = np.linspace([0, -0.4, 0.5, 0, 0.6, 0], [1, 0.2, 0.9, 0.4, 0.8, 0.2], 4)
    rows = [",".join(f"q{i}" for i in range(1, 7)), *(",".join(map(str, row)) for row in q)]
    (tmp_path / "path.csv").write_text("\n".join(rows), encoding="utf-8")

    done = armwright(
        *("tolerance", "puma560", TOLERANCES, "--csv", "path.csv", "--limit", "0.3", "--allocate", "statistical"),
        *("--samples", "50", "-o", "out"),
        cwd=tmp_path,
        columns=120,
    )

    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("report.html", "tolerance.json", "run.json", "errors.svg", "shares.svg", "costs.svg")
    }
    assert "mathdefault" not in (tmp_path / "out" / "costs.svg").read_text(encoding="utf-8")  # 2, not 2 × 10⁰
    lines = done.stdout.splitlines()
    first = next(i for i, line in enumerate(lines) if line.lstrip().startswith("dimension"))
    assert lines[first + 2].split()[0] == "joint2.theta"
    assert "Least cost for 0.3 mm by the statistical rule" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "expected the poses, either one as -q or a table of them as --csv FILE"),
        (("-q", Q_DEG, "--limit", "0"), "expected a number above 0, got 0"),
        (("-q", Q_DEG, "--allocate", "worst-case"), "specify --limit MM"),
        (("-q", "1,2"), "expected 6 finite numbers"),
    ],
)
def test_usage(arguments: tuple[str, ...], said: str) -> None:
    """What is missing or out of range is said."""
    done = armwright("tolerance", "puma560", TOLERANCES, *arguments)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.replace("│", " ").split())
