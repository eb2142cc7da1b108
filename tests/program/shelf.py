"""Programs on the shelf: the conformance programs, small ones by feature, and the cells they are meant for."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from armwright.errors import FileFormatError
from armwright.program import Compilation, KnownCell, Source, compile as translate
from armwright.program.language.words import Standard
from armwright.program.semantics.cell_symbols import ImportedFrames, ImportedModule, ReadImport

ONE_ARM = KnownCell(
    arms=frozenset({"ARM_1"}),
    frames={"STOP": "WORLD", "STATION": "WORLD"},
    visions=frozenset({"OBJ1", "OBJ2"}),
)
# One arm, a camera that finds everything, and no frame with a value.
BARE = KnownCell(arms=frozenset({"ARM_1"}))

HERE = Path(__file__).parent
CORPUS = HERE / "corpus"
REJECTED = sorted((HERE / "rejected").rglob("*.rlo"))
ACCEPTED = sorted((HERE / "accepted").rglob("*.rlo"))

EXPECTATION = re.compile(r"// expect: ([ELRW]\d{3}) line (\d+)")
CELL = re.compile(
    r"// cell: (arms|frames|devices|visions|reach|inputs|analogue|joints|targets|moving|flexible|flat) (.*)"
)
STRICT = re.compile(r"// strict$", re.MULTILINE)
OLD = re.compile(r"// std=83$", re.MULTILINE)
IMPORT = re.compile(r"// import: (\S+): (.*)")
MODULE = re.compile(r"// module: (\S+): (.*)")


def expectations(text: str) -> list[tuple[str, int]]:
    """Return codes and lines that the comments of a program expect."""
    return sorted((code, int(line)) for code, line in EXPECTATION.findall(text))


def cell_of(text: str) -> KnownCell | None:
    """Return the cell that the comments of a program describe."""
    told: Mapping[str, list[str]] = {what: re.split(r",\s*", names.strip()) for what, names in CELL.findall(text)}
    if not told:
        return None
    return KnownCell(
        arms=frozenset(told["arms"]),
        frames=hanging(told.get("frames", ())),
        devices=frozenset(told["devices"]) if "devices" in told else None,
        visions=frozenset(told["visions"]) if "visions" in told else None,
        inputs=frozenset(told["inputs"]) if "inputs" in told else None,
        analogue=frozenset(told.get("analogue", ())),
        joints=dict(one.split() for one in told.get("joints", ())),
        targets=dict(one.split(" of ") for one in told["targets"]) if "targets" in told else None,
        moving=frozenset(told["moving"]) if "moving" in told else None,
        flexible=frozenset(told["flexible"]) if "flexible" in told else None,
        flat=frozenset(told.get("flat", ())),
        reach=float(told["reach"][0]) if "reach" in told else None,
    )


def hanging(names: Iterable[str]) -> dict[str, str]:
    """Return what each frame hangs on, of names such as ``LID on CUP``."""
    parts = (name.partition(" on ") for name in names)
    return {name: parent or "WORLD" for name, _, parent in parts}


def imports_of(text: str) -> ReadImport | None:
    """Return a reader of the files that the comments of a program tell of; any other file is missing."""
    files = {path: hanging(re.split(r",\s*", names.strip())) for path, names in IMPORT.findall(text)}

    modules = dict(MODULE.findall(text))

    def read(path: str) -> ImportedFrames | ImportedModule:
        if path in modules:
            return ImportedModule(text=modules[path])
        if path not in files:
            raise FileFormatError(path, None, "", "there is no such file")
        return ImportedFrames(frames=files[path])

    return read if files or modules else None


def compile_file(path: Path) -> Compilation:
    """Translate a program as its comments ask for."""
    text = path.read_text(encoding="utf-8")
    return translate(
        Source(path.name, text),
        cell_of(text),
        strict=bool(STRICT.search(text)),
        std=Standard.RLO_83 if OLD.search(text) else Standard.RLO_2,
        read_import=imports_of(text),
    )


def said(compilation: Compilation) -> list[tuple[str, int]]:
    """Return codes and lines of what was said."""
    return sorted((one.code, compilation.source.line(one.span.start)) for one in compilation.diagnostics)


def compile_program(
    name: str, cell: KnownCell | None = None, *, strict: bool = False, std: Standard = Standard.RLO_2
) -> Compilation:
    """Translate one of the conformance programs."""
    text = (CORPUS / f"{name}.rlo").read_text(encoding="utf-8")
    return translate(Source(f"{name}.rlo", text), cell, strict=strict, std=std)
