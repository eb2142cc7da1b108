"""Write the table of limits into docs/limits.md: `python docs/make_limits.py`."""

import re
from pathlib import Path

from armwright.files.limits import LIMITS

PAGE = Path(__file__).parent / "limits.md"


def table() -> str:
    """Return the rows of the table as the page has them."""
    return "\n".join(f"| `{name}` | {one.usual:,} {one.unit} | {one.bounds} |" for name, one in LIMITS.items())


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    page = re.sub(r"(?<=\|---\|---\|---\|\n).*?(?=\n\n)", lambda _: table(), page, count=1, flags=re.DOTALL)
    PAGE.write_text(page, encoding="utf-8")
