"""The page of the studies: numbers of the sources beside those computed; `make studies` runs this (some minutes)."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

from armwright.study import (
    dh_calibration,
    five_bar_clearance,
    five_bar_life,
    linkage_simulators,
    puma_moves,
    stanford_torque,
)

PAGE = Path(__file__).parent / "studies.md"
HEAD = """\
# Studies

Published numbers of the sources beside those that armwright computes. `armwright study NAME` runs a study and prints \
more tables than this page; `-o DIR` writes a page of its figures and tables, `--json` prints its tables \
as data. `make studies` makes this page. Known reasons for differences are in the [errata](errata.md).

| study | source | takes |
|---|---|---|
| [`stanford-torque`](#stanford-torque) | report TR-83-008, appendices II and III, figures 3 to 11 | a second |
| [`puma-moves`](#puma-moves) | project on the trajectories of a PUMA, figures 5 to 25 | some seconds |
| [`five-bar-clearance`](#five-bar-clearance) | thesis on clearance in a five-bar, tables 5.3 to 5.12 | a minute |
| [`dh-calibration`](#dh-calibration) | the same thesis, section 2.3, table 2.4 | some seconds |
| [`five-bar-life`](#five-bar-life) | the same thesis, section 6.2 | two minutes |
| [`linkage-simulators`](#linkage-simulators) | Exudyn and MuJoCo | a minute |

The robot language of the report is tested by programs: eight of them run with the trace, the stages and the frames \
that the report specifies, and four wrong ones get the messages that it specifies \
(`tests/program/test_corpus.py`, `test_interpreter.py`, `test_corpus_runs.py`).
"""
Row = Sequence[str]


def table(head: Row, rows: Iterable[Row]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def percent(printed: float, computed: float) -> str:
    """Return the relative difference of a computed number from the printed one; a large one as a factor."""
    if not 0.2 < computed / printed < 5:
        return f"{computed / printed:.2g} times"
    return f"{100 * (computed / printed - 1):+.1f} %"


def triple(values: Iterable[float] | None, digits: int = 3) -> str:
    """Return numbers in one cell, a dash where there are none."""
    return "-" if values is None else ", ".join(f"{x:.{digits}f}" for x in values)


def stanford() -> Iterator[str]:
    """Yield the section on the efforts of the Stanford arm."""
    yield "## stanford-torque\n"
    yield "Constants of Bejczy's model, appendix III: fitted to the arm of appendix II at 2000 configurations.\n"
    rows = [*stanford_torque.coefficient_table(), *stanford_torque.load_table()]
    head = ("number", "unit", "printed", "computed", "difference", "verdict", "remark")
    yield from table(
        head,
        (
            (
                row.name,
                row.unit,
                f"{row.printed:g}",
                f"{row.computed:.4g}",
                percent(row.printed, row.computed),
                row.verdict,
                row.note,
            )
            for row in rows
        ),
    )
    forms = stanford_torque.form_table()
    yield (
        f"The printed form of D11 leaves {100 * forms[0].share:.0f} % of its standard deviation unexplained with "
        f"any constants, the form with the factor s2² {100 * forms[1].share:.0f} %.\n"
    )
    yield "Efforts over the motion of figures 3 to 5, which the report draws and does not print:\n"
    yield from table(
        ("joint", "unit", "peak", "peak with the load", "motor", "error of Bejczy's model", "effect of the load"),
        (
            (
                str(row.joint),
                row.unit,
                f"{row.peak:.2f}",
                f"{row.peak_loaded:.2f}",
                f"{row.limit:g}",
                f"{100 * row.bejczy:.0f} %",
                f"{100 * row.load:.0f} %",
            )
            for row in stanford_torque.joint_table(stanford_torque.torques())
        ),
    )


def puma() -> Iterator[str]:
    """Yield the section on the moves of the PUMA."""
    yield "## puma-moves\n"
    yield "Joint angles of the three poses in degrees, printed, and computed from the printed poses.\n"
    rows = []
    for row in puma_moves.configuration_table():
        rows.append((row.pose, "printed", *(f"{q:.2f}" for q in row.printed), ""))
        rows.append(("", "computed", *(f"{q:.2f}" for q in row.computed), f"{row.farthest:.2f}"))
    yield from table(("pose", "", *(f"joint {i}" for i in range(1, 7)), "difference"), rows)
    yield (
        "Rotations are printed with two digits, and B is near the singularity of the wrist, where an error of two "
        "digits changes angles by a degree. The moves, which the project draws:\n"
    )
    yield from table(
        (
            "move",
            "configurations solved",
            "deviation from the lines, mm",
            "tool rotates, deg",
            "speed of limit",
            "must be slowed",
        ),
        (
            (
                row.name,
                str(row.inverse),
                f"{row.deviation * 1e3:.0f}",
                f"{math.degrees(row.rotation):.0f}",
                f"{row.speed.part:.1f}, joint {row.speed.joint}",
                f"{row.slower:.1f} times",
            )
            for row in puma_moves.move_table()
        ),
    )


def board() -> Iterator[str]:
    """Yield the section on the arm calibrated on a board."""
    yield "## dh-calibration\n"
    yield (
        "Mean error at the six verification points. The thesis measured its own arm; ours is simulated, with errors "
        f"like those of the thesis, {dh_calibration.NOISE * 1e3:g} mm of noise of the cameras and a displaced base. So "
        "the rows compare by the improvement of each fit.\n"
    )
    rows = dh_calibration.verification_table()
    printed = {row.points: sum(row.printed) / len(row.printed) for row in rows if row.printed is not None}

    def shown(row: dh_calibration.Row) -> Row:
        name = row.model if row is rows[0] else f"{row.model}, {row.points}"
        theirs = printed[row.points] if row.printed is not None else None
        cells = [name, "-" if theirs is None else f"{theirs:.2f}", f"{row.mean:.3g}"]
        for mean, first in ((theirs, printed["none"]), (row.mean, rows[0].mean)):
            cells.append("-" if mean is None or row is rows[0] else f"{100 * (1 - mean / first):.0f} %")
        return cells

    head = ("fit", "printed, mm", "ours, mm", "printed, improvement", "ours, improvement")
    yield from table(head, map(shown, rows))


@cache
def swept() -> five_bar_clearance.SweepResult:
    """Return the simulations of the 729 linkages of the thesis, which take a minute."""
    return five_bar_clearance.run_sweep()


def five_bar() -> Iterator[str]:
    """Yield the section on clearance in the five-bar."""
    study = five_bar_clearance
    yield "## five-bar-clearance\n"
    yield "Table 5.3, repeatability of 30 cycles in mm, and table 5.4, features of the error curves of arm A.\n"
    yield from table(
        ("arm", "RP printed", "RP ours"),
        ((row.arm, f"{row.printed:.3f}", f"{row.ours:.3f}") for row in study.repeat_table()),
    )
    features = (
        (
            row.path,
            name,
            f"{row.printed[i]:.4f}",
            f"{row.centre[i]:.4f}",
            percent(row.printed[i], row.centre[i]),
            f"{row.surface[i]:.4f}",
        )
        for row in study.feature_table()
        for i, name in enumerate(("slope, mm/s", "intercept, mm", "amplitude, mm"))
    )
    head = ("path", "feature", "printed", "ours", "difference", "ours, friction by the speed of surfaces")
    yield from table(head, features)
    yield "Tables 5.5 to 5.8, clearances in mm estimated from the curves, and their accuracy.\n"
    estimates = study.estimate_table(swept())
    yield from table(
        ("arm", "method", "true", "printed", "mean accuracy", "ours", "mean accuracy"),
        (
            (
                row.arm,
                {"amp_dc": "amplitude"}.get(row.method, row.method),
                triple(row.true),
                triple(row.printed),
                "-" if row.printed_mean is None else f"{row.printed_mean:.2f} %",
                triple(row.ours),
                f"{row.mean:.2f} %",
            )
            for row in estimates
        ),
    )
    yield "Tables 5.10 and 5.12, errors at the three targets, in mm.\n"
    yield from table(
        ("arm", "path and clearances", "printed", "mean", "ours", "mean"),
        (
            (
                row.arm,
                row.case,
                triple(row.printed),
                "-" if row.printed is None else f"{sum(row.printed) / 3:.4f}",
                triple(row.ours, 4),
                f"{sum(row.ours) / 3:.4f}",
            )
            for row in (*study.target_table(estimates), *study.correction_table(estimates))
        ),
    )
    yield (
        "The error at the first target, where the arm rests, agrees to the last digit. At the others it depends on "
        "the profile between the nodes, which the thesis shows only in a figure, and after the first hard stop on "
        "chance.\n"
    )


def life() -> Iterator[str]:
    """Yield the section on the life of the five-bar, for which the thesis has no numbers."""
    yield "## five-bar-life\n"
    yield (
        "Section 6.2 of the thesis proposes future work and has no numbers. What armwright computes for its arms A and "
        "B, with an assumed wear coefficient and assumed tolerances:\n"
    )
    study = five_bar_life.FiveBarLife.run()
    for result in study.tables():
        yield f"{result.title}\n"
        yield from table(result.heads, result.rows)
    yield "\n".join(f"- {note}" for note in study.notes) + "\n"


def simulators() -> Iterator[str]:
    """Yield the section on linkages in other simulators."""
    yield "## linkage-simulators\n"
    heads = ("linkage", "motion", "simulator", "pins", "apart, µm", "until, s", "at the end, µm")
    study = linkage_simulators.LinkageSimulators.run()
    for told in study.tables():
        yield (
            "Linkages of the catalogue with clearance beside Exudyn, and with closed pins beside MuJoCo, which gets "
            "the efforts of the linkage without clearance and is to stay on the path. The largest distance of the "
            f"tips, with steps of 10 µs, is that before it passes {linkage_simulators.CHAOS * 1e6:g} µm. From there "
            "the pins rattle apart: so do those of two runs of armwright whose clearances differ by 10 nm. Without "
            "Exudyn its rows are missing; `pip install exudyn` adds them.\n"
        )
        yield from table(heads, told.rows)


# In the order of the page; five-bar-clearance, five-bar-life and linkage-simulators take a minute or more.
SECTIONS = {
    "stanford-torque": stanford,
    "puma-moves": puma,
    "five-bar-clearance": five_bar,
    "dh-calibration": board,
    "five-bar-life": life,
    "linkage-simulators": simulators,
}
QUICK = ("stanford-torque", "puma-moves", "dh-calibration")


def section(name: str) -> str:
    """Return the section of one study."""
    return "\n".join(SECTIONS[name]())


def text() -> str:
    """Return the page."""
    return "\n".join([HEAD, *map(section, SECTIONS)]).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
