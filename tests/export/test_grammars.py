"""The grammars of the checkers, and programs that others have written."""

from pathlib import Path

import pytest

from armwright.export.checkers.actions import CheckError
from armwright.export.checkers.grammar import parse

PROGRAMS = Path(__file__).parent / "programs"
LANGUAGES = {".src": "krl", ".sys": "rapid", ".mod": "rapid", ".script": "urscript", ".ls": "fanuc"}


@pytest.mark.parametrize("path", sorted(PROGRAMS.iterdir()), ids=lambda path: path.name)
def test_real_programs_are_read(path: Path) -> None:
    """Programs of controllers, and those that have their constructs, are of the grammar."""
    tree = parse(LANGUAGES[path.suffix], path.read_text(encoding="utf-8"))

    assert len(list(tree.iter_subtrees())) > 30


@pytest.mark.parametrize(
    ("language", "text", "line"),
    [
        ("urscript", "def a():\n  movej([0, 0)\nend\n", 2),
        ("urscript", "def a():\n  x = 1\n", 2),
        ("krl", "DEF a( )\nPTP {A1 0\nEND\n", 2),
        ("krl", "DEF a( )\nIF x THEN\nEND\n", 3),
        ("rapid", "MODULE a\n  PROC main()\n    MoveL p1,v100 fine,tool0;\n  ENDPROC\nENDMODULE\n", 3),
        ("rapid", "MODULE a\n  PROC main()\n  ENDMODULE\n", 3),
        ("fanuc", "/PROG A\n/ATTR\n/MN\n   1:J P[1] FINE ;\n/POS\n/END\n", 4),
        ("fanuc", "/PROG A\n/ATTR\n/MN\n   1:  DO[1]=ON\n/POS\n/END\n", 4),
    ],
)
def test_slips_are_found(language: str, text: str, line: int) -> None:
    """What is no program is refused with its line."""
    with pytest.raises(CheckError, match=f"line {line}"):
        parse(language, text)
