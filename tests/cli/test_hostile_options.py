"""Options with values that nobody means: refused with the option's name, in no time and without a traceback."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from armwright.cli.app import app
from armwright.errors import ArmwrightError

CELL = Path(__file__).resolve().parents[2] / "examples" / "puma_cell.toml"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("plan-poses", "puma560", "-n", "1000000000"), "count: expected 10,000 poses or fewer, got 1000000000"),
        (("plan-poses", "puma560", "-n", "-1"), "count: expected 1 pose or more, got -1"),
    ],
)
def test_too_many(arguments: tuple[str, ...], said: str) -> None:
    """What would take all memory is refused before it begins."""
    done = CliRunner().invoke(app, list(arguments))

    assert isinstance(done.exception, ArmwrightError)
    assert said in str(done.exception)


@pytest.mark.parametrize("value", ["inf", "nan", "-1", "1e308"])
def test_endless_time(value: str, tmp_path: Path) -> None:
    """A program is not run for ever."""
    (tmp_path / "a.rlo").write_text("BEGIN\n  PAUSE 1\nEND.\n")

    done = CliRunner().invoke(app, ["run", str(tmp_path / "a.rlo"), "--cell", str(CELL), f"--max-time={value}"])

    assert done.exit_code == 2
    assert "--max-time" in done.output


@pytest.mark.parametrize("option", [("-o", ""), ("--output", ""), ("--output=",)])
def test_output_without_a_name(option: tuple[str, ...], tmp_path: Path) -> None:
    """An empty name is no folder: nothing is written into the one where the command was started."""
    done = subprocess.run(
        [sys.executable, "-m", "armwright", "plan-poses", "puma560", "-n", "30", *option],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        timeout=60,
    )

    assert done.returncode == 2
    assert "expected a path, got an empty text" in " ".join(done.stderr.split())
    assert not [*tmp_path.iterdir()]
