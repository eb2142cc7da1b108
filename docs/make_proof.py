"""Write the table of the random samples that `make proof` has run: seeds, counts, failures, worst figures."""

import json
import sys
from pathlib import Path

_PAGE = Path(__file__).parent / "proof.md"
_HEAD = """# Random samples at full size

`make proof` runs every random sample of the tests at its full size and writes this page. `make test` draws a tenth of
each, or less where that takes minutes, anew in every run. A row is repeated with `ARMWRIGHT_SEED` set to its seed and
`ARMWRIGHT_PROOF=out/proof`. Of tests that are run for many arms, programs or quantities (`pytest.mark.drawn`) `make
test` draws a part anew in every run, too, which `--randomly-seed` repeats, and of the examples of Hypothesis a fifth;
`make proof` runs all of both.

| what was tried | count | failures | figures | seed | test |
|---|---:|---:|---|---:|---|
"""
_FIXED = ("test", "what", "seed", "count", "failures")


def table(folder: Path) -> dict[str, str]:
    """Return the rows of the page by what identifies them, from what the tests have counted."""
    rows = {}
    for file in sorted(folder.glob("*.json")):
        for row in json.loads(file.read_text()):
            told = {name.replace("_", " "): value for name, value in row.items() if name not in _FIXED}
            figures = "; ".join(
                f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}" for name, value in told.items()
            )
            cells = (row["what"], f"{row['count']:,}", row["failures"], figures, row["seed"], f"`{row['test']}`")
            rows[f"{row['test']} {row['what']}"] = f"| {' | '.join(map(str, cells))} |"
    return rows


def kept() -> dict[str, str]:
    """Return the rows of the page as it is, for the tests that were not run this time."""
    if not _PAGE.exists():
        return {}
    rows = {}
    for line in _PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and cells[-1].startswith("`"):
            rows[f"{cells[-1].strip('`')} {cells[0]}"] = line
    return rows


if __name__ == "__main__":
    rows = kept() | table(Path(sys.argv[1]))
    _PAGE.write_text(_HEAD + "".join(f"{rows[key]}\n" for key in sorted(rows)))
