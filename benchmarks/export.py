"""Exporting a thousand planned MOVEs: writing the files of each target, and the proof of its checker."""

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

from measure import progress, section, table

from armwright.export.api import export_run
from armwright.export.plan_mode import plan_statements
from armwright.export.writers import drive_csv, fanuc, krl, rapid, ros2, urscript
from armwright.program import Recording, Source, run

ROOT = Path(__file__).parents[1]
ARMS = ROOT / "tests" / "export" / "arms"
CELLS = {
    "ros2": ROOT / "examples" / "ur5_cell.toml",
    "csv": ROOT / "examples" / "ur5_cell.toml",
    "urscript": ROOT / "examples" / "ur5_cell.toml",
    "krl": ARMS / "kr6r900_cell.toml",
    "rapid": ARMS / "irb120_cell.toml",
    "fanuc": ARMS / "lrmate200id_cell.toml",
}
LANGUAGES = {"urscript": urscript, "krl": krl, "rapid": rapid, "fanuc": fanuc}
# 500 point-to-point moves and 500 straight lines.
PROGRAM = """
VAR a, b : FRAME ; n : SCALAR ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.10) ;
  FOR n = 1 TO 250 DO
  BEGIN
    MOVE ARM_1 TO a ;
    MOVE ARM_1 TO b STRAIGHTLY ;
    MOVE ARM_1 TO a ;
    MOVE ARM_1 TO a * XYZ(0, 0, 0.05) STRAIGHTLY ;
  END
END.
"""


@cache
def recorded(cell: Path) -> Recording:
    """Return the run in a cell."""
    progress(f"planning 1000 MOVEs in {cell.name}")
    return run(Source("moves.rlo", PROGRAM), cell)


def write(target: str, recording: Recording) -> int:
    """Write the files of a target, and return their size."""
    if target in LANGUAGES:
        return len(LANGUAGES[target].write(plan_statements(recording, "moves")).text)
    return sum(len(file.text) for file in (ros2 if target == "ros2" else drive_csv).write(recording, "ARM_1"))


def seconds(work: Callable[[], object]) -> float:
    """Return the shorter time of two [s]."""
    times = []
    for _ in range(2):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Measure and print."""
    rows = []
    for target, cell in CELLS.items():
        recording = recorded(cell)
        writing = seconds(lambda target=target, recording=recording: write(target, recording))
        proving = seconds(lambda target=target, recording=recording: export_run(target, recording, "moves"))
        size = write(target, recording) / 1e6
        rows.append([f"`{target}`", f"{writing:.2f}", f"{proving:.2f}", f"{size:.2f}"])
    section(
        "Exporting programs",
        "1000 MOVEs that have been planned, half of them straight lines: writing the files, and writing them with the "
        "proof of their checker.",
        table(["target", "writing, s", "with the proof, s", "MB"], rows),
    )


if __name__ == "__main__":
    main()
