"""Modules: programs in several files mean what the same program in one file means, and messages name the file."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.errors import InvalidValueError
from armwright.files.limits import raised
from armwright.program import Compilation, Source, compile as translate, run
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.debugger import Debugger
from armwright.program.debugger.expressions import names_to_write
from armwright.program.diagnostics.fixes import apply_fixes
from armwright.program.diagnostics.render import render
from armwright.program.diagnostics.sarif import to_sarif
from armwright.program.language.diagnostic import to_json
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Analysis, Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.diagnostics import lsp_diagnostics
from armwright.program.language_server.hover import hover
from armwright.program.language_server.rename import rename
from armwright.program.repl.session import Session
from armwright.program.semantics.cell_symbols import ImportedFrames, ImportedModule
from armwright.program.syntax import tree
from armwright.program.vm.interpreter import interpret
from cli_calls import armwright
from program.debugger.client import Client
from program.running import cell_of, printed
from program.shelf import ACCEPTED, CORPUS, OLD, compile_file

EXAMPLES = Path(__file__).parents[2] / "examples"
GRIP = """MODULE grip ;
CONST width = 0.04 ;
VAR n : SCALAR ;
PROCEDURE take ;
BEGIN
  OPEN ARM_1 TO width
END ;
END.
"""

Files = dict[str, str]


def compiled(main: str, files: Files, cell: Any = None, *, strict: bool = False) -> Compilation:
    """Compile a program with modules that lie nowhere."""

    def read(path: str) -> ImportedFrames | ImportedModule:
        if path not in files:
            raise InvalidValueError(f"there is no {path}")
        return ImportedModule(text=files[path])

    return translate(Source("main.rlo", main), cell, read_import=read, strict=strict)


def said(program: Compilation) -> list[tuple[str, str, int]]:
    """Return codes, files and lines of the errors."""
    source = program.source
    spans = ((one.code, one.span.start) for one in program.diagnostics if one.is_error)
    return [(code, source.name_at(start), source.line(start)) for code, start in spans]


def operations(code: Code) -> list[tuple[str, ...]]:
    """Return what instructions do, without where they stand in a text."""
    return [(step.op.value, *map(str, step.operands), str(step.begins)) for step in code.instructions]


def is_movable(path: Path) -> bool:
    """Whether the declarations of a program of the shelf can go into a module as they are."""
    text = path.read_text(encoding="utf-8")
    bare = re.sub(r"//.*|\{[^}]*\}", "", text)
    odd = OLD.search(text) or re.search(r"\bIMPORT\b", bare, re.IGNORECASE) or bare.lstrip()[:1].isdigit()
    return not odd and re.match(r"\s*(VAR|CONST|UNITS|PROCEDURE|FUNCTION)\b", bare, re.IGNORECASE) is not None


MOVABLE = [*filter(is_movable, (*sorted(CORPUS.glob("p*.rlo")), *ACCEPTED))]


@pytest.mark.parametrize("path", MOVABLE, ids=lambda path: f"{path.parent.name}/{path.stem}")
@pytest.mark.drawn(0.3)
def test_declarations_in_a_module(path: Path) -> None:
    """A program whose declarations are moved into a module compiles to the same code."""
    whole = compile_file(path)
    text, headers = whole.source.text, whole.tree.headers
    last = max(header.span.end for header in headers)
    begin = next(one.start for one in whole.tokens if one.key == "BEGIN" and one.start >= last)
    units = "".join(f"{whole.source.slice(one.span)} ;\n" for one in headers if isinstance(one, tree.Units))
    files = {"m.rlo": f"MODULE declared ;\n{text[:begin]}\nEND."}
    main = f'IMPORT "m.rlo" ;\n{units}{text[begin:]}'
    parts = compiled(main, files, whole.cell_symbols, strict=whole.strict)

    assert whole.code is not None
    assert parts.code is not None, said(parts)
    # What has the name of a word of the language is qualified, as the program may mean that.
    linked = [tuple(part.replace("DECLARED.", "") for part in step) for step in operations(parts.code)]
    assert linked == operations(whole.code)
    assert parts.code.constants == whole.code.constants
    assert {key.removeprefix("DECLARED."): kind for key, kind in parts.code.types.items()} == whole.code.types
    assert assemble(assembly(parts.code)) == parts.code


def test_example_moves_like_one_file() -> None:
    """The example with two modules moves the arm as the same program in one file does."""
    cell = read_cell(EXAMPLES / "stanford_cell.toml")
    parts = run(EXAMPLES / "fetch.rlo", cell)
    gripping, tray = (
        (EXAMPLES / "modules" / f"{name}.rlo").read_text(encoding="utf-8") for name in ("gripping", "tray")
    )
    main = (EXAMPLES / "fetch.rlo").read_text(encoding="utf-8")
    # The counter of the tray has the name of the program's own.
    tray = tray.replace("n : SCALAR", "k : SCALAR").replace("FOR n", "FOR k").replace("slot[n]", "slot[k]")
    tray = tray.replace("n-1", "k-1")
    pieces = [one.split("UNITS MM ;")[1].rpartition("BEGIN\n") for one in (gripping, tray, main)]
    headers = "".join(head for head, _, _ in pieces[:2]) + main.split("UNITS MM ;")[1].partition("BEGIN\n")[0]
    statements = "".join(body.rpartition("END.")[0] for _, _, body in pieces[:2])
    statements += main.split("UNITS MM ;")[1].partition("BEGIN\n")[2]
    one_file = f"UNITS MM ;\n{headers}BEGIN\n{statements}"
    one_file = one_file.replace("tray.slot", "slot").replace("gripping.moved", "moved")
    whole = run(Source("one.rlo", one_file), cell)

    assert parts.trace() == whole.trace()
    assert [stage.duration for stage in parts.stages] == [stage.duration for stage in whole.stages]
    np.testing.assert_array_equal(parts.tree.world("PART"), whole.tree.world("PART"))


WRONG = {
    "the file is named": (
        'IMPORT "g.rlo" ;\nBEGIN take() ; END.',
        {"g.rlo": GRIP.replace("OPEN ARM_1", "OPEN")},
        [("E111", "g.rlo", 6)],
    ),
    "flow in a module": (
        'IMPORT "g.rlo" ;\nBEGIN take() ; END.',
        {"g.rlo": GRIP.replace("TO width", "TO n")},
        [("E303", "g.rlo", 6)],
    ),
    "missing": ('IMPORT "h.rlo" ;\nBEGIN take() ; x = y ; END.', {}, [("E228", "main.rlo", 1)]),
    "missing for a module": (
        'IMPORT "g.rlo" ;\nBEGIN END.',
        {"g.rlo": 'MODULE g ; IMPORT "h.rlo" ; END.'},
        [("E228", "g.rlo", 1)],
    ),
    "upwards": ('IMPORT "../g.rlo" ;\nBEGIN END.', {"../g.rlo": GRIP}, [("E228", "main.rlo", 1)]),
    "absolute": ('IMPORT "/g.rlo" ;\nBEGIN END.', {"/g.rlo": GRIP}, [("E228", "main.rlo", 1)]),
    "itself": ('MODULE m ;\nIMPORT "main.rlo" ;\nEND.', {}, [("E251", "main.rlo", 2)]),
    "two modules of one name": (
        'IMPORT "a.rlo" ; IMPORT "b.rlo" AS b ;\nBEGIN END.',
        {"a.rlo": "MODULE m ;\nEND.", "b.rlo": "MODULE m ;\nEND."},
        [("E250", "b.rlo", 1)],
    ),
    "MODULE in the middle": ("VAR n : SCALAR ;\nMODULE m ;\nEND.", {}, [("E250", "main.rlo", 2)]),
    "a cell file renamed": (
        'IMPORT "c.toml" AS c ;\nBEGIN END.',
        {},
        [("E250", "main.rlo", 1), ("E228", "main.rlo", 1)],
    ),
    "a name of the file": (
        'IMPORT "g.rlo" ;\nVAR take : FRAME ;\nBEGIN END.',
        {"g.rlo": GRIP},
        [("E252", "main.rlo", 2)],
    ),
    "two modules called alike": (
        'IMPORT "a.rlo" AS m ; IMPORT "b.rlo" AS m ;\nBEGIN END.',
        {"a.rlo": "MODULE a ; END.", "b.rlo": "MODULE b ; END."},
        [("E252", "main.rlo", 1)],
    ),
    "what a module of a module gives": (
        'IMPORT "a.rlo" ;\nBEGIN\n  take() ;\nEND.',
        {"a.rlo": 'MODULE a ; IMPORT "g.rlo" ; END.', "g.rlo": GRIP},
        [("E253", "main.rlo", 3)],
    ),
    "what the program has": (
        'IMPORT "a.rlo" ;\nVAR secret : SCALAR ;\nBEGIN\n  secret = 1 ; show() ;\nEND.',
        {"a.rlo": "MODULE a ;\nPROCEDURE show ;\nBEGIN PRINT(secret) END ;\nEND."},
        [("E253", "a.rlo", 3)],
    ),
    "behind AS": ('IMPORT "g.rlo" AS g ;\nBEGIN\n  take() ;\nEND.', {"g.rlo": GRIP}, [("E253", "main.rlo", 3)]),
    "no such module": ("BEGIN\n  PRINT(g.width) ;\nEND.", {}, [("E202", "main.rlo", 2)]),
    "a declared name with a point": ("VAR a.b : SCALAR ;\nBEGIN END.", {}, [("E101", "main.rlo", 1)]),
    "a MOVE in a module": (
        'IMPORT "a.rlo" ;\nBEGIN END.',
        {"a.rlo": "MODULE a ;\nBEGIN\n  IF 1 = 1 THEN OPEN ARM_1\nEND."},
        [("E255", "a.rlo", 3)],
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_programs(case: str) -> None:
    """What is wrong is said once, with the file and the line."""
    main, files, expected = WRONG[case]

    assert sorted(said(compiled(main, files))) == sorted(expected)


RIGHT: dict[str, tuple[str, Files]] = {
    "qualified": ('IMPORT "g.rlo" ;\nBEGIN grip.take() ; PRINT(GRIP.Width) ; END.', {"g.rlo": GRIP}),
    "renamed": (
        'IMPORT "g.rlo" AS jaw ;\nVAR take : SCALAR ;\nBEGIN take = jaw.width ; jaw.take() ; PRINT(take) ; END.',
        {"g.rlo": GRIP},
    ),
    "a parameter hides": (
        'IMPORT "g.rlo" ;\nPROCEDURE p(width : SCALAR) ;\nBEGIN PRINT(width, grip.width) END ;\nBEGIN p(1) END.',
        {"g.rlo": GRIP},
    ),
    "in a folder, and from there": (
        'IMPORT "lib/a.rlo" ;\nBEGIN PRINT(twice) END.',
        {"lib/a.rlo": 'MODULE a ; IMPORT "g.rlo" ; CONST twice = 2 * width ; END.', "lib/g.rlo": GRIP},
    ),
    "one module twice": (
        'IMPORT "a.rlo" ; IMPORT "g.rlo" ;\nBEGIN PRINT(twice, width) END.',
        {"a.rlo": 'MODULE a ; IMPORT "g.rlo" ; CONST twice = 2 * width ; END.', "g.rlo": GRIP},
    ),
    "words of the language": (
        'IMPORT "a.rlo" AS a ;\nBEGIN PRINT(TIME, a.time, MAX(1, 2), a.max(3)) END.',
        {"a.rlo": "MODULE a ; CONST time = 3 ; FUNCTION max(n : SCALAR) : SCALAR ; BEGIN RETURN n END ; END."},
    ),
    "names may be module and as": ("VAR module, as : SCALAR ;\nBEGIN module = 1 ; as = module ; PRINT(as) END.", {}),
}


@pytest.mark.parametrize("case", RIGHT)
def test_right_programs(case: str) -> None:
    """These have neither errors nor warnings, and their code can be written and read."""
    main, files = RIGHT[case]
    program = compiled(main, files, cell_of("cell1"))

    assert program.diagnostics == ()
    assert program.code is not None
    assert assemble(assembly(program.code)) == program.code


def test_words_of_the_language_stay() -> None:
    """A module that calls something TIME or MAX changes nothing for the program that does not."""
    main, files = RIGHT["words of the language"]

    assert run(compiled(main, files, cell_of("cell1"))).trace() == ['PRINT "0 3 2 3"']


def test_initial_values_come_in_the_order_of_imports() -> None:
    """A module has its values before whoever imports it, also before other modules."""
    files = {
        "a.rlo": 'MODULE a ; IMPORT "b.rlo" ; VAR first : SCALAR ; BEGIN first = second + 1 END.',
        "b.rlo": "MODULE b ; VAR second : SCALAR ; BEGIN second = 41 END.",
    }
    program = compiled('IMPORT "a.rlo" ;\nBEGIN PRINT(first) END.', files, cell_of("cell1"))

    assert run(program).trace()[-1] == 'PRINT "42"'


def test_frames_of_the_cell_are_declared_once() -> None:
    """Two files that declare one frame of the cell would make two frames of it."""
    cell = cell_of("cell1")
    frame = next(name for name in cell.frames if name not in ("WORLD", "STATION"))
    module = f"MODULE a ; VAR {frame} : FRAME ; END."
    main = f'IMPORT "a.rlo" AS a ;\nVAR {frame} : FRAME ;\nBEGIN PRINT({frame}, a.{frame}) END.'

    assert said(compiled(main, {"a.rlo": module}, cell))[0] == ("E252", "main.rlo", 2)
    assert said(compiled(f'IMPORT "a.rlo" ;\nBEGIN PRINT({frame}) END.', {"a.rlo": module}, cell)) == []


def test_texts_name_the_file() -> None:
    """Text, JSON and SARIF give the module's own file, lines and offsets."""
    files = {"lib/g.rlo": GRIP.replace("TO width", "TO wide")}
    program = compiled('IMPORT "lib/g.rlo" ;\nVAR take : FRAME ;\nBEGIN END.', files)
    shown = render(program.diagnostics, program.source)
    data = [to_json(one, program.source) for one in program.diagnostics if one.code == "E202"]
    sarif = to_sarif([(program.diagnostics, program.source, "cell/main.rlo")])
    places = {
        (one["ruleId"], one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"])
        for one in sarif["runs"][0]["results"]
    }

    assert "--> lib/g.rlo:6:17\n   |\n 6 |   OPEN ARM_1 TO wide\n" in shown
    assert "--> main.rlo:2:5\n" in shown
    assert "::: lib/g.rlo:4:11\n" in shown
    at = files["lib/g.rlo"].index("wide")
    assert [(one["file"], one["line"], one["start"], one["end"]) for one in data] == [("lib/g.rlo", 6, at, at + 4)]
    assert {("E202", "cell/lib/g.rlo"), ("E252", "cell/main.rlo")} <= places


def test_fixes_touch_their_own_file() -> None:
    """What is certain is cured in the program; a slip in a module is cured when that is."""
    files = {"g.rlo": GRIP.replace("width ;", "width")}
    files["g.rlo"] = GRIP.replace("SCALAR ;", "SCALAR")
    main = 'IMPORT "g.rlo" ;\nBEGIN\n  take()\n  OPEN ARM_1 ;\nEND.'
    result = apply_fixes(Source("main.rlo", main), lambda source: compiled(source.text, files))

    assert result.text == main.replace("take()", "take();")
    assert [one.description for one in result.applied] == ["inserted `;`"]


def test_files_lie_in_the_folder(tmp_path: Path) -> None:
    """A module is found beside the file that imports it, or below; links do not lead out, and files are not listed."""
    inside, outside = tmp_path / "project", tmp_path / "secret.rlo"
    (inside / "lib").mkdir(parents=True)
    outside.write_text(GRIP, encoding="utf-8")
    (inside / "lib" / "grip.rlo").write_text(GRIP, encoding="utf-8")
    (inside / "linked.rlo").symlink_to(outside)
    program = inside / "main.rlo"
    program.write_text('IMPORT "lib/grip.rlo" ;\nBEGIN take() ; END.', encoding="utf-8")
    assert translate(program).diagnostics == ()

    for path in ("linked.rlo", "../secret.rlo", str(outside), "lib", "none.rlo", "lib/../linked.rlo"):
        program.write_text(f'IMPORT "{path}" ;\nBEGIN END.', encoding="utf-8")
        assert {one.code for one in translate(program).diagnostics} == {"E228"}, path


def test_number_of_modules_is_bounded() -> None:
    """A chain of more modules than files may be imported ends with one clear word."""
    files = {f"m{i}.rlo": f'MODULE m{i} ; IMPORT "m{i + 1}.rlo" ; END.' for i in range(40)}
    with raised(imports=20):
        program = compiled('IMPORT "m0.rlo" ;\nBEGIN END.', files)

    assert said(program) == [("E228", "m19.rlo", 1)]


def test_length_of_all_files_is_bounded() -> None:
    """Files that are allowed one by one may be too long together."""
    files = {f"m{i}.rlo": f"MODULE m{i} ; {{{' ' * 300_000}}} END." for i in range(4)}
    imports = " ".join(f'IMPORT "m{i}.rlo" ;' for i in range(4))
    with raised(program_mb=1):
        program = compiled(f"{imports}\nBEGIN END.", files)

    assert [one.code for one in program.diagnostics] == ["E228"]


def test_cell_of_a_module() -> None:
    """A cell that only a module imports is that of the program; it is looked for beside the module."""
    asked: list[str] = []
    cell = cell_of("cell1")

    def read(path: str) -> ImportedFrames | ImportedModule:
        asked.append(path)
        if path == "lib/a.rlo":
            return ImportedModule(text='MODULE a ; IMPORT "cell.json" ; END.')
        return ImportedFrames(frames={name: node.parent for name, node in cell.frames.items()}, cell=cell)

    program = translate(Source("main.rlo", 'IMPORT "lib/a.rlo" ;\nBEGIN OPEN ARM_1 ; END.'), read_import=read)

    assert program.diagnostics == ()
    assert program.cell is not None
    assert asked == ["lib/a.rlo", "lib/cell.json"]


def test_where_modules_cannot_be_whole() -> None:
    """A text without a file, and a session, refuse modules by name."""
    text = 'IMPORT "g.rlo" ;\nBEGIN END.'
    assert [one.code for one in translate(Source("t.rlo", text)).diagnostics] == ["E228"]
    talk = Session(cell_of("cell1"), read_import=lambda _: ImportedModule(text=GRIP))
    answer = talk.enter('IMPORT "g.rlo" ;')

    assert [one.code for one in answer.diagnostics] == ["E228"]


def test_module_alone() -> None:
    """A module is checked by itself, without warnings of names that others use."""
    assert translate(Source("g.rlo", GRIP)).diagnostics == ()
    with_local = GRIP.replace("PROCEDURE take ;", "PROCEDURE take ;\nVAR k : SCALAR ;")
    assert [one.code for one in translate(Source("g.rlo", with_local)).diagnostics] == ["L304"]


def test_files_of_a_run(tmp_path: Path) -> None:
    """The record of a run names the modules, and the events their files; code written out runs the same."""
    program, cell = str(EXAMPLES / "fetch.rlo"), str(EXAMPLES / "stanford_cell.toml")
    assert armwright("run", program, "--cell", cell, "-o", "out", cwd=tmp_path).returncode == 0
    record = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    events = [json.loads(line) for line in (tmp_path / "out" / "events.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [Path(one["path"]).name for one in record["inputs"]["imports"]] == ["gripping.rlo", "tray.rlo"]
    assert {one.get("file") for one in events} == {None, "modules/gripping.rlo", "modules/tray.rlo"}

    assert armwright("code", program, "--cell", cell, "-o", "fetch.rlc", cwd=tmp_path).returncode == 0
    assert armwright("run", "fetch.rlc", "--cell", cell, "-o", "again", cwd=tmp_path).returncode == 0
    assert (tmp_path / "again" / "events.jsonl").read_text() == (tmp_path / "out" / "events.jsonl").read_text()


def test_terminal_debugger() -> None:
    """A breakpoint is set in a module, and stack and listing show its file."""
    program, cell = EXAMPLES / "fetch.rlo", EXAMPLES / "stanford_cell.toml"
    commands = ("b modules/gripping.rlo:13", "b nowhere.rlo:3", "c", "where", "list", "b 20", "q")
    done = armwright("debug", program, "--cell", cell, fed="".join(f"{one}\n" for one in commands))
    lines = done.stdout.replace("(rlo) ", "").splitlines()

    assert "breakpoint 1 in line 13 of modules/gripping.rlo" in lines
    assert any("nowhere.rlo" in line and "modules/tray.rlo" in line for line in lines)
    assert any("take, line 13 of modules/gripping.rlo" in line for line in lines)
    assert any("program, line 12: take(part, feeder) ;" in line for line in lines)
    assert any(line.startswith(">  13") for line in lines)
    assert "breakpoint 2 in line 20 of modules/gripping.rlo" in lines


def test_debug_adapter() -> None:
    """An editor sets breakpoints in each file, and is told the file of each place of the stack."""
    gripping, program = EXAMPLES / "modules" / "gripping.rlo", EXAMPLES / "fetch.rlo"
    with Client() as client:
        client.ask("initialize")
        client.ask("launch", program=str(program), cell=str(EXAMPLES / "stanford_cell.toml"))
        for path, line in ((gripping, 13), (program, 15)):
            asked = client.ask("setBreakpoints", source={"path": str(path)}, breakpoints=[{"line": line}])
            (bound,) = asked["breakpoints"]
            assert (bound["verified"], bound["source"]["path"]) == (True, str(path))
        starts = client.ask("breakpointLocations", source={"path": str(gripping)}, line=9, endLine=12)
        assert [one["line"] for one in starts["breakpoints"]] == [9, 10, 11, 12]
        client.ask("configurationDone")
        client.wait("stopped")
        stack = [(one["name"], one["source"]["path"], one["line"]) for one in client.stack()]
        assert stack == [("take", str(gripping), 13), ("program", str(program), 12)]
        assert client.ask("setBreakpoints", source={"path": str(gripping)}, breakpoints=[])["breakpoints"] == []
        assert client.step("continue")["reason"] == "breakpoint"

        assert client.line() == 15


BOXES = """MODULE boxes ;
RECORD box ; weight : SCALAR ; END ;
VAR n, own : SCALAR ; b : box ; row : ARRAY [2] OF box ;
FUNCTION twice(v : SCALAR) : SCALAR ;
BEGIN
  RETURN 2 * v * n
END ;
PROCEDURE put(INOUT p : box) ;
BEGIN
  p.weight = n + own
END ;
BEGIN
  n = 3 ; own = 5 ; b.weight = 1 ; row[1] = b ; row[2] = b ;
END.
"""


def test_debugger_knows_names_of_modules() -> None:
    """An expression means what it means in the file of the place where the program stands."""
    main = 'IMPORT "boxes.rlo" AS g ;\nVAR n, p : SCALAR ;\nBEGIN\n  n = 1 ; p = 9 ; g.put(g.row[2]) ; PRINT(n)\nEND.\n'
    cell = cell_of("cell1")
    program = compiled(main, {"boxes.rlo": BOXES}, cell)
    assert program.code is not None
    assert assemble(assembly(program.code)) == program.code
    debugger = Debugger(program.code, cell)
    debugger.begin()
    debugger.add_breakpoint(4, 38)
    debugger.add_breakpoint(10, file=1, condition="boxes.n = 3 AND n = 3 AND g.own = own AND own = 5")
    seen, offered = [], []
    while debugger.running:
        debugger.run_slice(1.0)
    for _ in range(2):
        debugger.resume("continue")
        while debugger.running:
            debugger.run_slice(1.0)
        names = ("n", "g.n", "boxes.n", "g.own", "g.twice(2)", "g.b.weight", "g.row[1 + 1].weight", "g.row[2]", "p")
        procedure = debugger.stack(())[0].procedure
        offered.append({*names_to_write(debugger.machine, procedure)} - {"WORLD", "STATION"})
        seen.append([debugger.evaluate(name, ()).value for name in names])

    assert seen == [
        ["3", "3", "3", "5", "12", "1", "1", "weight = 1", "weight = 1"],
        ["1", "3", "3", "5", "12", "1", "8", "weight = 8", "9"],
    ]
    assert {"g.n", "boxes.n", "g.own", "g.b", "g.row", "b.weight", "row"} <= offered[1]
    assert "row.weight" not in offered[0] | offered[1]
    assert {"p", "p.weight", "own"} <= offered[0]


def in_editor(folder: Path) -> tuple[Analysis, str]:
    """Analyse a program beside a module as an editor does; return it with its text."""
    (folder / "lib").mkdir()
    (folder / "lib" / "g.rlo").write_text(GRIP, encoding="utf-8")
    text = (
        'IMPORT "lib/g.rlo" AS jaw ;\nVAR n : SCALAR ;\nBEGIN\n  n = jaw.width ;\n  jaw.take() ;\n  PRINT(n) ;\nEND.\n'
    )
    return analyse("main.rlo", PositionCodec(text), folder, CellCache(), Settings()), text


def test_hover_and_definition_cross_files(tmp_path: Path) -> None:
    """A name of a module is explained, and leads to its line in the file of the module."""
    analysis, text = in_editor(tmp_path)
    shown = hover(analysis, text.index("width"), markdown=False)
    named = analysis.occurrence_at(text.index("take"))
    assert shown is not None
    assert named is not None
    declared = analysis.declaration(named)
    assert declared is not None
    place = analysis.location("file:///main.rlo", declared.span)
    for at in (text.index("jaw ;"), text.index("jaw.width") + 1, text.index("jaw.take")):
        module = hover(analysis, at, markdown=False)
        assert module is not None
        assert module.contents.value == "MODULE jaw\nfile lib/g.rlo\ngives take, width, n"  # type: ignore[union-attr]

    assert shown.contents.value == "width : SCALAR\ndeclared in line 2 of lib/g.rlo"  # type: ignore[union-attr]
    assert place.uri == (tmp_path / "lib" / "g.rlo").as_uri()
    assert (place.range.start.line, place.range.start.character) == (3, 10)
    with pytest.raises(InvalidValueError, match=r"declared in lib/g\.rlo"):
        rename(analysis, text.index("take"), "grab")


def test_completion_knows_modules(tmp_path: Path) -> None:
    """Names of a module are offered as the program may write them; its own too where they are alike."""
    analysis, text = in_editor(tmp_path)
    values = [item.label for item in completions(analysis.codec, analysis, text.index("jaw.width") + 4, snippets=False)]
    starts = [item.label for item in completions(analysis.codec, analysis, text.index("jaw.take"), snippets=False)]

    assert {*values} == {"jaw.width", "jaw.n"}
    assert "n" in starts
    assert "jaw.take" in starts
    assert not {"width", "take"} & {*values, *starts}


def test_editor_points_at_the_import(tmp_path: Path) -> None:
    """Errors of a module are shown at its IMPORT, with their places in its file."""
    analysis, text = in_editor(tmp_path)
    assert lsp_diagnostics(analysis, "file:///main.rlo", related=True) == []
    (tmp_path / "lib" / "g.rlo").write_text(GRIP.replace("TO width", "TO wide"), encoding="utf-8")
    analysis = analyse("main.rlo", PositionCodec(text), tmp_path, CellCache(), Settings())
    (told,) = lsp_diagnostics(analysis, "file:///main.rlo", related=True)

    assert told.range.start.line == 0
    assert told.message == "lib/g.rlo has 1 error; the first: `wide` is not declared"
    assert [one.location.range.start.line for one in told.related_information or ()] == [5]


def test_names_of_timers_and_whens_are_no_variables() -> None:
    """A timer or WHEN in a module may have the name of a variable of any file, or of a record."""
    module = """MODULE m ;
    VAR own : SCALAR ;
    PROCEDURE work ;
    BEGIN
      WHEN k : TIMER(t) > 0.1 DO BEGIN WHEN k OFF ; TIMER t OFF ; own = own + 1 END ;
      WHEN own : TIMER(own) > 0.2 DO PRINT("late", TIMER(t)) ;
      TIMER t ON ; TIMER own ON ; PAUSE 0.3 ; WHEN own OFF ;
    END ;
    BEGIN own = 1 END.
    """
    main = """IMPORT "m.rlo" AS m ;
    RECORD part ; weight : SCALAR ; END ;
    VAR t : part ; k, own : SCALAR ;
    BEGIN
      t.weight = 5 ; k = 6 ; own = 7 ;
      m.work() ;
      PRINT(t, k, own, m.own, TIMER(t)) ;
    END.
    """
    cell = cell_of("cell1")
    code = compiled(main, {"m.rlo": module}, cell).code

    assert code is not None
    assert printed(interpret(code, cell, Simulator(cell))) == ["late 0.101", "5 6 7 2 0.101"]


def test_record_types_of_one_name_are_two_types() -> None:
    """Records of two modules do not become one another, though their types have one name."""
    one, other = (
        f"""MODULE {name} ;
        RECORD part ; {fields} : SCALAR ; END ;
        VAR mine : part ;
        PROCEDURE show(p : part) ; BEGIN PRINT(p.weight, p.length) END ;
        BEGIN mine.weight = 1 ; mine.length = 2 END.
        """
        for name, fields in (("one", "weight, length"), ("other", "length, weight"))
    )
    files = {"one.rlo": one, "other.rlo": other}
    main = """IMPORT "one.rlo" AS one ; IMPORT "other.rlo" AS other ;
    BEGIN
      one.show(one.mine) ;
      other.show(one.mine) ;
      other.mine = one.mine ;
    END."""
    found = compiled(main, files).diagnostics

    assert [(one.code, main[: one.span.start].count("\n") + 1) for one in found] == [("E262", 4), ("E262", 5)]


def test_a_module_is_no_value() -> None:
    """The name of a module alone is refused, with what could be meant."""
    found = compiled('IMPORT "grip.rlo" AS g ; VAR n : SCALAR ; BEGIN n = g END.', {"grip.rlo": GRIP}).diagnostics

    assert found[0].code == "E253"
    assert found[0].message == "`g` is a module, and one of its names is needed here"
    assert found[0].helps == ("write `g.take`",)
