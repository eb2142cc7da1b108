"""Write the table of the catalogue into docs/arms.md: `python docs/make_arms.py`."""

import re
from pathlib import Path

from armwright.arm.documents import gives_geometry
from armwright.arm.load import ArmSummary, arm_summaries

PAGE = Path(__file__).parent / "arms.md"
COLUMNS = ("positions", "speeds", "efforts", "masses", "drives", "coupling", "solids")


def table() -> str:
    """Return the rows of the table as the page has them."""
    return "\n".join(map(_row, arm_summaries()))


def _row(arm: ArmSummary) -> str:
    given = {quantity for document in arm.documents for quantity in document.gives}
    two = "two documents" if sum(map(gives_geometry, arm.documents)) > 1 else "one document"
    marks = " | ".join("yes" if column in given else "" for column in COLUMNS)
    return f"| `{arm.name}` | {arm.title} | {arm.joints} | {two} | {marks} |"


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    head = r"\| coupling \| solids \|\n[|-]+\n"
    page = re.sub(rf"({head}).*?(?=\n\n)", lambda found: found[1] + table(), page, count=1, flags=re.DOTALL)
    PAGE.write_text(page, encoding="utf-8")
