"""Lines of CSV."""

import csv
import io
from collections.abc import Iterable


def csv_line(cells: Iterable[str]) -> str:
    """Return cells as a line of CSV without its end; one with a comma, a quote or a line end is quoted."""
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(cells)
    return line.getvalue()
