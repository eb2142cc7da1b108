"""Figures as SVG text that is identical for identical numbers: curves, bars, and parts of other figures."""

import base64
import html
import io
import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.report.svg import inline_svg, normalize_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Line styles in the order of the curves: the first is the reference; all are distinguishable without colour.
_STYLES = ("-", "--", "-.", ":")
# Characters of a name that are shown at most.
_MAX_LENGTH = 40
# Width of a title, and its lines at most.
_CHARACTERS_PER_INCH, _MAX_LINES = 9, 3


class Drawing(NamedTuple):
    """A figure.

    Attributes:
        name: name of its file without the suffix.
        caption: its caption.
        svg: text of the file.
    """

    name: str
    caption: str
    svg: str

    @property
    def files(self) -> Mapping[str, str]:
        """Its only file by name."""
        return {f"{self.name}.svg": self.svg}

    @property
    def element(self) -> str:
        """The figure as an element of a page, in the colours of the page."""
        caption = html.escape(self.caption)
        drawing = inline_svg(self.svg, self.name).replace("<svg", f'<svg role="img" aria-label="{caption}"', 1)
        return f"<figure>{drawing}<figcaption>{caption}</figcaption></figure>"


class Film(NamedTuple):
    """A film, in one or more formats.

    Attributes:
        name: name of its files without the suffix.
        caption: its caption.
        files: its files by name; a GIF is among them.
    """

    name: str
    caption: str
    files: Mapping[str, bytes]

    @property
    def element(self) -> str:
        """The film as an element of a page, which includes its data."""
        caption, data = html.escape(self.caption), base64.b64encode(self.files[f"{self.name}.gif"]).decode()
        image = f'<img src="data:image/gif;base64,{data}" alt="{caption}">'
        return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def curves(
    title: str,
    x: Array,
    lines: Mapping[str, Array],
    *,
    x_label: str,
    y_label: str,
    spans: Sequence[tuple[float, float]] = (),
    fits: Mapping[str, tuple[Array, Array]] | None = None,
    logarithmic: bool = False,
) -> str:
    """Draw curves over a common axis, with shaded intervals and fitted straight lines.

    Args:
        title: title of the figure.
        x: (m,) the common axis.
        lines: (m,) values by the name of the curve.
        x_label: quantity and unit of ``x``.
        y_label: quantity and unit of the curves.
        spans: bounds of the shaded intervals.
        fits: abscissae (k,) and values (k,) of lines over the curves, by name.
        logarithmic: whether the axis of the curves is.

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((7, 4.2))
    axes = plain_axes(figure, x_label, y_label)
    for i, (name, y) in enumerate(lines.items()):
        axes.plot(x, y, _STYLES[i % len(_STYLES)], label=plain_label(name), linewidth=1.6)
    for name, (abscissae, values) in (fits or {}).items():
        axes.plot(abscissae, values, "k--", label=plain_label(name), linewidth=1.4)
    for low, high in spans:
        axes.axvspan(low, high, color="0.88", zorder=0)
    if logarithmic:
        axes.set_yscale("log")
    axes.set(title=figure_title(figure, title), xlim=(float(x[0]), float(x[-1])))
    if len(axes.lines) > 1:
        axes.legend()
    return svg_text(figure)


def bar_chart(
    title: str, names: Sequence[str], values: Mapping[str, Sequence[float]], *, y_label: str, logarithmic: bool = False
) -> str:
    """Draw groups of bars side by side.

    Args:
        title: title of the figure.
        names: names of the groups.
        values: a value per group, by the name of the series.
        y_label: quantity and unit of the values.
        logarithmic: whether the axis of the values is logarithmic.

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((7.6, 4.2))
    axes = figure.subplots()
    width = 0.8 / len(values)
    for i, (name, heights) in enumerate(values.items()):
        axes.bar([k + (i + 0.5) * width - 0.4 for k in range(len(names))], heights, width, label=plain_label(name))
    axes.set(title=figure_title(figure, title), ylabel=y_label, xticks=range(len(names)), xticklabels=names)
    axes.set_yscale("log" if logarithmic else "linear")
    axes.grid(visible=True, axis="y", alpha=0.3)
    figure.legend(fontsize="small", loc="outside lower center", ncols=len(values))
    return svg_text(figure)


def empty_figure(size: tuple[float, float]) -> "Figure":
    """Return a figure of this width and height [inch], whose parts do not overlap."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - costs half a second, and only figures need it

    return Figure(figsize=size, layout="constrained")


def plain_axes(figure: "Figure", x: str, y: str) -> "Axes":
    """Return the axes of a figure with a single plot, with their names and units, and a grid."""
    axes = figure.subplots()
    axes.set(xlabel=x, ylabel=y)
    axes.grid(visible=True, alpha=0.3)
    return axes


def set_equal_scales(axes: Any, low: Array, high: Array, *, least: float = 0.0) -> float:
    """Set equal scales along x, y and z, so that right angles appear as right angles.

    Args:
        axes: axes in space.
        low: (3,) smallest coordinates.
        high: (3,) largest coordinates.
        least: half of the shown length at least.

    Returns:
        Half of the shown length.
    """
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2, least)
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        set_limits(centre - half, centre + half)
    axes.set_box_aspect((1, 1, 1))
    return half


def evenly_spaced(count: int, most: int) -> Array:
    """Return the indices of at most this many rows, evenly distributed, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, most).astype(int))


def round_number(x: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 ... that is not above x; 1 for all below."""
    if x < 1:
        return 1.0
    power = 10.0 ** math.floor(math.log10(x))
    return max(digit * power for digit in (1, 2, 5) if digit * power <= x)


def svg_text(figure: "Figure", title: str = "") -> str:
    """Return a figure, below its title if it has one, as the text of an SVG file, the same on every machine."""
    import matplotlib as mpl  # noqa: PLC0415

    if title:
        figure.suptitle(figure_title(figure, title))
    text = io.StringIO()
    # Without a date and with fixed identifiers, a figure changes only when its numbers do.
    with mpl.rc_context({"svg.hashsalt": "armwright"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return normalize_svg(text.getvalue())


def figure_title(figure: "Figure", text: str) -> str:
    """Return the title of a figure in lines as wide as the figure, at most three; see ``plain_label``."""
    width = int(_CHARACTERS_PER_INCH * figure.get_figwidth())
    lines = textwrap.wrap(_printable(text), width, max_lines=_MAX_LINES, placeholder="...")
    return "\n".join(lines).replace("$", r"\$")


def plain_label(text: str) -> str:
    """Return a text of the user for a figure: dollars begin no formulas, and all characters are printable.

    Tabs and line breaks become blanks, other unprintable characters become replacement characters, and a long text is
    truncated.
    """
    return _printable(text if len(text) <= _MAX_LENGTH else f"{text[:_MAX_LENGTH]}...").replace("$", r"\$")


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in text)
