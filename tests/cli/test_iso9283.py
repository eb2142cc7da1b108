"""``armwright iso9283`` as a user calls it."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from cli_calls import armwright

EXAMPLES = Path(__file__).parents[2] / "examples"
POSES, PATHS = EXAMPLES / "measured_poses.csv", EXAMPLES / "measured_paths.csv"
DOCS = (EXAMPLES.parent / "docs" / "iso9283.md").read_text(encoding="utf-8")


def page_example() -> str:
    """The file that the page shows."""
    block = DOCS.partition("    test,pose,cycle")[2].partition("\n\n")[0]
    return "\n".join(line.strip() for line in f"test,pose,cycle{block}".split("\n")) + "\n"


def test_report(tmp_path: Path) -> None:
    """Measures are printed with their cycles and limits; the page, the numbers and a figure per result are written."""
    done = armwright(
        "iso9283", POSES, PATHS, "-o", tmp_path / "out", "--limit", "RP=0.05mm", "--limit", "AT=0.2mm", columns=110
    )

    assert done.returncode == 5
    assert done.stderr.startswith("armwright: limit exceeded: RP of pose P1")
    assert done.stderr.endswith("mm, and at most 0.05 mm is allowed\n")
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"report.html", "measures.json", "01-pose.svg", "05-path.svg", "07-cornering.svg"} <= written
    rows = {line.split()[0]: line for line in done.stdout.split("\n") if line.strip()}
    assert "exceeds" in rows["RP"]
    assert "holds" in rows["AT"]
    assert "planar reduction: settling P1, path line, cornering square measured in a plane" in done.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == sum(name.endswith(".svg") for name in written)
    assert "http" not in page.replace("http-equiv", "")
    # Once, beside the heading; the largest RP is above all.
    assert page.count("limit exceeded") == 1
    measures = json.loads((tmp_path / "out" / "measures.json").read_text(encoding="utf-8"))["measures"]
    largest = max(one["value"] for one in measures if one["symbol"] == "RP")
    assert f'<li class="figure bad"><b>{largest * 1e3:.4f} mm</b><small>RP, pose repeatability, of P2' in page
    assert "<td>AP<sub>x</sub></td>" in page
    # Readings are in thousandths; every length has one digit more.
    lengths = re.findall(r'<td class="number">(?:± )?-?([0-9.]+)</td><td>mm</td>', page)
    assert len(lengths) > 20
    assert all(len(text.partition(".")[2]) == 4 for text in lengths)


def test_conditions_of_the_tests(tmp_path: Path) -> None:
    """What is said of the tests is in the report and the data; what is not said is a line to fill in."""
    about = ("--about", "robot=PUMA 560, no. <7>", "--about", "date = 2026-07-01")
    done = armwright("iso9283", POSES, "-o", tmp_path / "out", *about)

    assert done.returncode == 0, done.stderr
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<dt>Robot, serial number</dt><dd>PUMA 560, no. &lt;7&gt;</dd>" in page
    assert "<dt>Date of the measurement</dt><dd>2026-07-01</dd>" in page
    blank = re.findall(r'<dt>([^<]*)</dt><dd class="blank"></dd>', page)
    assert blank == ["Load", "Speed", "Ambient temperature", "Measuring instrument", "Operator"]
    told = json.loads((tmp_path / "out" / "measures.json").read_text(encoding="utf-8"))
    assert told["about"] == {"robot": "PUMA 560, no. <7>", "date": "2026-07-01"}


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["colour=red"], "expected one of robot, load"),
        (["robot"], "expected one of robot, load"),
        (["robot="], "expected one of robot, load"),
        (["robot=a", "robot=b"], "robot is said twice"),
    ],
)
def test_conditions_that_are_none(texts: list[str], said: str) -> None:
    done = armwright("iso9283", POSES, *(word for text in texts for word in ("--about", text)), columns=200)

    assert done.returncode == 2
    assert said in done.stderr


@pytest.mark.parametrize("how", ["-q", "--json"])
def test_exceeded_limit_ends_with_status_five(how: str) -> None:
    """Whoever asks for a limit in a script learns that it is exceeded from the status and one line, and which it is."""
    done = armwright("iso9283", POSES, "--limit", "RP=0.05mm", "--limit", "AP=1mm", how)

    assert done.returncode == 5
    assert done.stderr.startswith("armwright: limit exceeded: RP of pose P1")
    assert "AP" not in done.stderr
    assert (done.stdout == "") == (how == "-q")
    if done.stdout:
        told = json.loads(done.stdout)
        assert (told["exit_status"], told["error"]["class"]) == (5, "CheckFailedError")


def test_json() -> None:
    """JSON has every measure in SI units, with cycles and limit."""
    done = armwright("iso9283", POSES, "--limit", "RP=0.08 mm", "--json")

    found = json.loads(done.stdout)
    first = next(one for one in found["measures"] if one["symbol"] == "RP")
    assert (first["unit"], first["cycles"], first["few"], first["holds"]) == ("m", 30, False, True)
    assert first["limit"] == pytest.approx(8e-5)
    assert not found["planar"]
    assert found["exit_status"] == 0


def test_the_page_of_the_format(tmp_path: Path) -> None:
    """The file on the page is read; its two cycles are too few, and with --few it is said how many there are."""
    path = tmp_path / "today.csv"
    path.write_text(page_example(), encoding="utf-8")

    refused, taken = armwright("iso9283", path), armwright("iso9283", path, "--few")

    assert refused.returncode == 3
    assert refused.stderr == "armwright: pose P1: ISO 9283 requires 30 cycles, got 2; --few accepts fewer\n"
    assert taken.returncode == 0, taken.stderr
    assert "2 of 30" in taken.stdout
    assert "fewer cycles than ISO 9283 requires" in taken.stdout
    # On average 0.1315, 0.0385 and 0.097 mm off.
    assert "0.1679" in taken.stdout


SLIPS = [
    ("y_mm", "y_m"),
    ("x_mm", "x"),
    ("400.129", ""),
    ("400.129", '"400,129"'),
    ("P1,2,", "P1,1,"),
    ("commanded,400,0,300", "commanded,0.4,0,0.3"),
]


@pytest.mark.parametrize("slip", range(len(SLIPS)))
def test_mistakes_of_the_page(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips are answered with, but for their line."""
    path = tmp_path / "today.csv"
    path.write_text(page_example().replace(*SLIPS[slip]), encoding="utf-8")

    done = armwright("iso9283", "today.csv", cwd=tmp_path)

    assert done.returncode == 4
    said = done.stderr.removeprefix("armwright: ").strip()
    assert f"`{said}`" in DOCS


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        ((EXAMPLES / "measured_pose.csv",), 4, "no such file; did you mean"),
        ((POSES, "--limit", "RP=0.05"), 2, "RP is in mm: RP=0.05mm, got ''"),
        ((POSES, "--limit", "RP=0.05m"), 2, "RP is in mm: RP=0.05mm, got 'm'"),
        ((POSES, "--limit", "RP"), 2, "expected a symbol and a number with its unit, RP=0.05mm, got RP"),
        ((POSES, "--limit", "RQ=1mm"), 2, "no measure 'RQ'"),
        ((POSES, "--band-mm", "0"), 2, "expected a number above 0, got 0"),
        ((PATHS,), 2, "settling P1: no band is specified, and pose P1 has no test whose RP"),
        ((), 2, "Missing argument"),
    ],
)
def test_mistakes(arguments: tuple[Any, ...], status: int, said: str) -> None:
    """A mistake gets one message that says what to do, and no traceback."""
    done = armwright("iso9283", *arguments, columns=200)

    assert done.returncode == status
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
