"""The study of the Stanford arm's efforts: TR-83-008, appendices II and III, figures 3 to 11."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar

import attrs

from armwright.files.result_table import ResultTable
from armwright.report.figures import curves
from armwright.study.stanford_torque import (
    FormRow,
    JointRow,
    PrintedRow,
    Torques,
    coefficient_table,
    figure,
    form_table,
    joint_table,
    load_table,
    torques,
)


@attrs.frozen(kw_only=True, eq=False)
class StanfordTorque:
    """Efforts of the Stanford arm over the report's motion, and every printed constant with a verdict.

    Attributes:
        constants: constants of Bejczy's model, printed and fitted.
        load: parameters of link 6 with the largest payload, printed and computed.
        forms: residuals of forms of D11.
        efforts: efforts over the motion.
        joints: the largest efforts of each joint.
    """

    constants: list[PrintedRow]
    load: list[PrintedRow]
    forms: list[FormRow]
    efforts: Torques
    joints: list[JointRow]

    notes: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> "StanfordTorque":  # noqa: ARG003 - takes a second
        """Run the study."""
        efforts = torques()
        return cls(
            constants=coefficient_table(),
            load=load_table(),
            forms=form_table(),
            efforts=efforts,
            joints=joint_table(efforts),
        )

    def as_data(self) -> dict[str, Any]:
        """Return the tables as plain data."""
        tables: Mapping[str, Iterable[Any]] = {
            "constants": self.constants,
            "load": self.load,
            "form of D11": self.forms,
            "joints": self.joints,
        }
        return {name: [attrs.asdict(row) for row in rows] for name, rows in tables.items()}

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables, printed beside computed."""
        heads = ("constant", "printed", "computed", "unit", "verdict", "remark")
        for title, rows in (
            ("Bejczy's model, appendix III", self.constants),
            ("Link 6 with the largest load, appendix II", self.load),
        ):
            yield ResultTable(
                title=title,
                heads=heads,
                rows=[
                    (row.name, f"{row.printed:g}", f"{row.computed:.4g}", row.unit, row.verdict, row.note)
                    for row in rows
                ],
            )
        yield ResultTable(
            title="Residuals of forms of D11",
            heads=("form", "residual, kg m²", "unexplained"),
            rows=[(row.form, f"{row.residual:.4f}", f"{row.share * 100:.0f} %") for row in self.forms],
        )
        yield ResultTable(
            title="Efforts over the motion of figures 3 to 5",
            heads=("joint", "peak", "peak, loaded", "motor", "error of Bejczy's model", "effect of the load"),
            rows=[
                (
                    str(row.joint),
                    f"{row.peak:.2f}",
                    f"{row.peak_loaded:.2f}",
                    f"{row.limit:g} {row.unit}",
                    f"{row.bejczy * 100:.0f} %",
                    f"{row.load * 100:.0f} %",
                )
                for row in self.joints
            ],
        )

    def figures(self) -> dict[str, str | bytes]:
        """Return figures 3 to 11 by the name of their file."""
        files: dict[str, str | bytes] = {}
        for number in range(3, 12):
            shown = figure(self.efforts, number)
            files[f"figure{number:02d}.svg"] = curves(
                f"Figure {number}: {shown.title}", self.efforts.t, shown.lines, x_label="time, s", y_label=shown.unit
            )
        return files
