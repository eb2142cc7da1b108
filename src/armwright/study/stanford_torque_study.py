"""The study of the Stanford arm's efforts: TR-83-008, appendices II and III, figures 3 to 11."""

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import attrs

from armwright.files.result_table import ResultTable
from armwright.report.figures import curves
from armwright.study import stanford_torque as study


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

    constants: list[study.PrintedRow]
    load: list[study.PrintedRow]
    forms: list[study.FormRow]
    efforts: study.Torques
    joints: list[study.JointRow]

    notes: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> "StanfordTorque":  # noqa: ARG003 - takes a second
        """Run the study."""
        efforts = study.torques()
        joints = study.joint_table(efforts)
        constants, load, forms = study.coefficient_table(), study.load_table(), study.form_table()
        return cls(constants=constants, load=load, forms=forms, efforts=efforts, joints=joints)

    def as_data(self) -> dict[str, Any]:
        """Return the tables as plain data."""
        data = attrs.asdict(self, filter=attrs.filters.exclude("efforts"))
        return {"form of D11" if name == "forms" else name: rows for name, rows in data.items()}

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables, printed beside computed."""
        for title, table in (
            ("Bejczy's model, appendix III", self.constants),
            ("Link 6 with the largest load, appendix II", self.load),
        ):
            yield ResultTable(
                title=title,
                heads=("constant", "printed", "computed", "unit", "verdict", "remark"),
                rows=[(x.name, f"{x.printed:g}", f"{x.computed:.4g}", x.unit, x.verdict, x.note) for x in table],
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
                    *(str(row.joint), f"{row.peak:.2f}", f"{row.peak_loaded:.2f}", f"{row.limit:g} {row.unit}"),
                    *(f"{row.bejczy * 100:.0f} %", f"{row.load * 100:.0f} %"),
                )
                for row in self.joints
            ],
        )

    def figures(self) -> dict[str, str | bytes]:
        """Return figures 3 to 11 by the name of their file."""
        files: dict[str, str | bytes] = {}
        for number in range(3, 12):
            panel = study.figure(self.efforts, number)
            title, t = f"Figure {number}: {panel.title}", self.efforts.t
            files[f"figure{number:02d}.svg"] = curves(title, t, panel.lines, x_label="time, s", y_label=panel.unit)
        return files
