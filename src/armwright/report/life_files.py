"""The files of the life of an arm: a page, its numbers, and figures of components and of the repeatability."""

import json
from collections.abc import Iterator

import numpy as np

from armwright.reliability.arm_life import ArmLife
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.static_page import static_page


def life_files(life: ArmLife, *, command: str) -> dict[str, str]:
    """Return the files of a life by name.

    Args:
        life: of the arm.
        command: the command line that made it.
    """
    drawn = list(_drawings(life))
    exceeded = any(one.exceeded for one in life.components)
    beside = {"life.json": "loads and lives of every component, and cycles until the limit"}
    cards = [Card("Life", tables(life.tables()))]
    if drawn:
        cards.append(Card("Figures", figures(drawn)))
    return {
        "life.json": json.dumps(life.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=f"Life of {life.arm.name}",
            command=command,
            sections=[*cards, Card("Files", downloads(beside, drawn))],
            numbers=_tiles(life),
            notes=life.notes,
            warnings=(),
            verdict=("the motion exceeds ratings", False) if exceeded else None,
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _tiles(life: ArmLife) -> Iterator[Tile]:
    yield Tile(f"{life.cycle:.4g} s", "a cycle")
    if life.components and np.isfinite(life.hours):
        first = life.components[0]
        yield Tile(f"{life.hours:,.0f} h", "that nine in ten arms live")
        yield Tile(f"joint {first.joint + 1}", f"first to fail, its {first.name}", mark="bad" if first.exceeded else "")
    if life.play is not None and life.limit is not None:
        surely = life.play.quantile(0.05)
        text = f"{surely:,.4g}" if np.isfinite(surely) else "endless"
        yield Tile(text, f"cycles with RP within {life.limit * 1e3:g} mm, with 95 %")


def _drawings(life: ArmLife) -> Iterator[Drawing]:
    known = [one for one in life.components if np.isfinite(one.hours)]
    if known:
        yield Drawing("components", "components: hours that nine in ten reach, and their rating", _components(life))
    if life.curve is not None:
        yield Drawing(
            "repeatability",
            "repeatability: at the pose that passes the limit first, with the middle nine tenths of random arms",
            _repeatability(life),
        )


def _components(life: ArmLife) -> str:
    known = [one for one in life.components if np.isfinite(one.hours)]
    figure = empty_figure((7.4, 1.0 + 0.3 * len(known)))
    axes = plain_axes(figure, "hours", "")
    places = np.arange(len(known))[::-1]
    colours = ["C3" if one.exceeded else "C0" for one in known]
    axes.barh(places, [one.hours for one in known], height=0.6, color=colours)
    axes.plot([one.rating.hours for one in known], places, "|", color="C7", markersize=14, label="rated")
    axes.set_yticks(places, [f"joint {one.joint + 1} {one.name}" for one in known])
    axes.set_xscale("log")
    axes.grid(visible=False, axis="y")
    axes.legend(fontsize="small")
    return svg_text(figure, "Lives of components")


def _repeatability(life: ArmLife) -> str:
    assert life.curve is not None  # noqa: S101 - drawn only then
    assert life.limit is not None  # noqa: S101 - there is no curve without one
    cycles, (low, middle, high) = life.curve
    figure = empty_figure((7.4, 3.8))
    axes = plain_axes(figure, "cycles", "repeatability RP, mm")
    axes.fill_between(cycles, low * 1e3, high * 1e3, color="C0", alpha=0.2, label="nine tenths of random arms")
    axes.plot(cycles, middle * 1e3, color="C0", label="median")
    axes.axhline(life.limit * 1e3, color="C7", linestyle=":", label="limit")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.legend(fontsize="small")
    return svg_text(figure, "Repeatability over the cycles")
