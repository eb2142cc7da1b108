"""The page of the studies: numbers of the sources beside those computed; `make studies` runs this (a minute)."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

from armwright.study import dh_calibration, five_bar_clearance, puma_moves, stanford_torque

PAGE = Path(__file__).parent / "studies.md"
HEAD = """\
# Studies

What the sources print beside what armwright computes. `armwright study NAME` runs one of them and prints more than \
stands here; `-o DIR` draws its figures, `--json` gives its tables as data. `make studies` makes this page. Where the \
two differ for a reason, the reason stands in the [errata](errata.md).

| study | source | takes |
|---|---|---|
| [`stanford-torque`](#stanford-torque) | report TR-83-008, appendices II and III, figures 3 to 11 | a second |
| [`puma-moves`](#puma-moves) | project on the trajectories of a PUMA, figures 5 to 25 | some seconds |
| [`five-bar-clearance`](#five-bar-clearance) | thesis on play in a five-bar, tables 5.3 to 5.12 | a minute |
| [`dh-calibration`](#dh-calibration) | the same thesis, section 2.3, table 2.4 | some seconds |

The robot language of the report has no numbers but programs: eight of them run with the trace, the stages and the \
frames that the reading of the report foresees, and four wrong ones get the messages it foresees \
(`tests/program/test_corpus.py`, `test_interpret.py`, `test_corpus_runs.py`).
"""
Row = Sequence[str]


def table(head: Row, rows: Iterable[Row]) -> Iterator[str]:
    """Give the lines of a table."""
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def percent(printed: float, computed: float) -> str:
    """Return how far a computed number is from the printed one, as a part of the printed; far off, as a factor."""
    if not 0.2 < computed / printed < 5:
        return f"{computed / printed:.2g} times"
    return f"{100 * (computed / printed - 1):+.1f} %"


def triple(values: Iterable[float] | None, digits: int = 3) -> str:
    """Return numbers in one cell, a dash where there are none."""
    return "-" if values is None else ", ".join(f"{x:.{digits}f}" for x in values)


def stanford() -> Iterator[str]:
    """Give the section on the efforts of the Stanford arm."""
    yield "## stanford-torque\n"
    yield "Constants of Bejczy's model, appendix III: fitted to the arm of appendix II over 2000 postures.\n"
    rows = [*stanford_torque.coefficient_table(), *stanford_torque.load_table()]
    head = ("number", "unit", "printed", "computed", "apart", "verdict", "remark")
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
        f"D11 in the printed form leaves {100 * forms[0].share:.0f} % of its spread unexplained whatever its "
        f"constants, with the factor s2² {100 * forms[1].share:.0f} %.\n"
    )
    yield "Efforts over the motion of figures 3 to 5, which the report draws and does not print:\n"
    yield from table(
        ("joint", "unit", "peak", "peak with the load", "of the motor", "Bejczy's model is off by", "the load changes"),
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
    """Give the section on the moves of the PUMA."""
    yield "## puma-moves\n"
    yield "Joint angles of the three poses in degrees, printed, and computed from the printed poses.\n"
    rows = []
    for one in puma_moves.configuration_table():
        rows.append((one.pose, "printed", *(f"{q:.2f}" for q in one.printed), ""))
        rows.append(("", "computed", *(f"{q:.2f}" for q in one.computed), f"{one.farthest:.2f}"))
    yield from table(("pose", "", *(f"joint {i}" for i in range(1, 7)), "apart"), rows)
    yield (
        "Rotations are printed with two digits, and B stands near the singularity of the wrist, where two digits are "
        "worth a degree. The moves, which the project draws:\n"
    )
    yield from table(
        (
            "move",
            "postures solved",
            "off the straight ways, mm",
            "hand turns, deg",
            "speed of limit",
            "must run slower",
        ),
        (
            (
                row.way,
                str(row.inverse),
                f"{row.off * 1e3:.0f}",
                f"{math.degrees(row.turn):.0f}",
                f"{row.speed.part:.1f}, joint {row.speed.joint}",
                f"{row.slower:.1f} times",
            )
            for row in puma_moves.move_table()
        ),
    )


def board() -> Iterator[str]:
    """Give the section on the arm calibrated on a board."""
    yield "## dh-calibration\n"
    yield (
        "Mean error at the six verification points. The thesis measured its own arm; ours is simulated, with errors "
        f"like those it found, {dh_calibration.NOISE * 1e3:g} mm of noise of the cameras and a base that stands a "
        "little beside where it should. So the rows are to be compared in how much better a fit makes the arm.\n"
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

    head = ("fit", "printed, mm", "ours, mm", "printed, better by", "ours, better by")
    yield from table(head, map(shown, rows))


@cache
def learnt() -> five_bar_clearance.Learnt:
    """Return the 729 linkages of the thesis, simulated; this is what takes a minute."""
    return five_bar_clearance.learnt()


def five_bar() -> Iterator[str]:
    """Give the section on play in the five-bar."""
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
    head = ("path", "feature", "printed", "ours", "apart", "ours, friction by the speed of surfaces")
    yield from table(head, features)
    yield "Tables 5.5 to 5.8, clearances told from the curves, in mm, and how near they come to the given ones.\n"
    estimates = study.estimate_table(learnt())
    yield from table(
        ("arm", "by", "given", "printed", "mean accuracy", "ours", "mean accuracy"),
        (
            (
                row.arm,
                {"amp_dc": "amplitude"}.get(row.way, row.way),
                triple(row.given),
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
        "The error at the first target, where the arm rests, comes out to the last digit. At the others it depends on "
        "the profile between the nodes, which the thesis shows in a figure only, and after the first hard stop on "
        "chance.\n"
    )


# In the order of the page; the last but one is not quick.
SECTIONS = {
    "stanford-torque": stanford,
    "puma-moves": puma,
    "five-bar-clearance": five_bar,
    "dh-calibration": board,
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
