"""The study of the Stanford arm's efforts: TR-83-008, appendices II and III, figures 3 to 11."""

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import attrs

from armwright.files.result_table import ResultTable
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, curves
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

    title: ClassVar[str] = "efforts of the Stanford arm (TR-83-008, figures 3 to 11)"
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

    def headline(self) -> Iterator[Tile]:
        """Give how many printed constants agree, and the largest errors of the simpler models."""
        printed = [*self.constants, *self.load]
        agreeing = sum(row.verdict == "agrees" for row in printed)
        yield Tile(f"{agreeing} of {len(printed)}", "printed constants agree")
        wrong = sum(row.verdict == "wrong" for row in printed)
        yield Tile(str(wrong), "printed constants are wrong", mark="warn" if wrong else "")
        worst = max(self.joints, key=lambda row: row.bejczy)
        yield Tile(f"{worst.bejczy * 100:.0f} %", f"largest error of Bejczy's model, joint {worst.joint}")
        loaded = max(self.joints, key=lambda row: row.peak_loaded / row.limit)
        share = loaded.peak_loaded / loaded.limit
        label = f"of what its motor gives, joint {loaded.joint} with the largest load"
        yield Tile(f"{share * 100:.0f} %", label, mark="bad" if share > 1 else "")

    def figures(self) -> list[Drawing]:
        """Return figures 3 to 11."""
        drawn = []
        for number in range(3, 12):
            panel = study.figure(self.efforts, number)
            title, t = f"Figure {number}: {panel.title}", self.efforts.t
            svg = curves(title, t, panel.lines, x_label="time, s", y_label=panel.unit)
            drawn.append(Drawing(f"figure{number:02d}", title, svg))
        return drawn
