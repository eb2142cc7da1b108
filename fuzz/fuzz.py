"""Coverage-guided fuzzing of everything that reads what a user types: `python fuzz/fuzz.py TARGET [-runs=N]`.

Targets are `tokens` (the lexer), `tree` (lexer and parser), `program` (lexer, parser, checker, flow and translator),
all three in both languages, `format` (the formatter on what has no errors), `cell` (cell files, TOML and JSON) and
`code` (the text form of intermediate code).
An input fails when anything but the reader's own error is raised, when it takes more than a second (three under the
watch, which slows everything down), or when memory grows beyond 2 GB. Inputs that reach new code are kept in
`out/fuzz/TARGET`; a run without limits goes on from them.
"""

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path

import atheris

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
KEPT = ROOT / "out" / "fuzz"
# Where cell files are written: in memory, where that is possible, as a slow disk counts as a slow reader.
SCRATCH = Path("/dev/shm") if Path("/dev/shm").is_dir() else KEPT  # noqa: S108 - Linux has it for this

# What is watched: the readers, and not the mechanics that a cell calls for its arms, which the watch would slow down.
WATCHED = ["armwright.program", "armwright.cell", "armwright.files", "armwright.arm", "armwright.arrays"]

with atheris.instrument_imports(include=WATCHED):
    from armwright.cell.reader import read_cell
    from armwright.errors import ArmwrightError, FileFormatError
    from armwright.program import Source, compile as translate
    from armwright.program.bytecode.assembler import assemble, assembly
    from armwright.program.diagnostics.render import render
    from armwright.program.formatter.format import formatted
    from armwright.program.language.words import VOCABULARIES, Standard
    from armwright.program.syntax.lexer import scan
    from armwright.program.syntax.line_numbers import blank_line_numbers
    from armwright.program.syntax.parser import parse


def _text(data: bytes) -> str:
    """Return any text: bytes that are no UTF-8 become characters of their own, as no file can hold them."""
    return data.decode("utf-8", errors="surrogateescape").encode("utf-8", "replace").decode("utf-8")


def tokens(data: bytes) -> None:
    """Every character is in a token, a comment, a blank or a diagnostic; tokens are in order."""
    source = Source("fuzz.rlo", _text(data))
    text, _ = blank_line_numbers(source)
    for std in Standard:
        found = scan(source, text, std)
        at = 0
        for token in found.tokens:
            assert at <= token.start <= token.end <= len(text)
            at = token.start


def tree(data: bytes) -> None:
    """A text has a tree, and what is wrong with it lies inside it."""
    source = Source("fuzz.rlo", _text(data))
    text, _ = blank_line_numbers(source)
    for std in Standard:
        _, diagnostics = parse(source, scan(source, text, std).tokens, std)
        for one in diagnostics:
            assert 0 <= one.span.start <= one.span.end <= len(source.text)


def program(data: bytes) -> None:
    """A program is translated, or something is said about it; what is said can be shown."""
    source = Source("fuzz.rlo", _text(data))
    for std in Standard:
        compiled = translate(source, std=std)
        assert (compiled.code is None) == any(one.is_error for one in compiled.diagnostics)
        render(compiled.diagnostics, source)
        if compiled.code is not None:
            assert assemble(assembly(compiled.code)) == compiled.code


def layout(data: bytes) -> None:
    """What has been formatted once stays as it is."""
    source = Source("fuzz.rlo", _text(data))
    try:
        once = formatted(source, std=Standard.RLO_2)
    except ArmwrightError:
        return
    assert formatted(Source("fuzz.rlo", once), std=Standard.RLO_2) == once


def cell(data: bytes) -> None:
    """A cell file is read, or refused with file and line."""
    for suffix in (".toml", ".json"):
        path = SCRATCH / f"armwright-fuzz{suffix}"
        path.write_bytes(data)
        # Anything else than this error is a fault of the reader.
        with contextlib.suppress(FileFormatError):
            read_cell(path)


def code(data: bytes) -> None:
    """Code is read, or refused with the number of the line; what is read can be written."""
    try:
        found = assemble(_text(data))
    except FileFormatError:
        return
    assert assemble(assembly(found)) == found


TARGETS: dict[str, Callable[[bytes], None]] = {
    "tokens": tokens,
    "tree": tree,
    "program": program,
    "format": layout,
    "cell": cell,
    "code": code,
}


def seeds(name: str) -> Path:
    """Write the programs, cells or codes of the tests as first inputs; return their folder."""
    folder = KEPT / name
    folder.mkdir(parents=True, exist_ok=True)
    corpus = ROOT / "tests" / "program"
    if name == "cell":
        paths = [*(corpus / "corpus").glob("*.json"), *(ROOT / "examples").glob("*cell*.toml")]
    else:
        paths = [*corpus.rglob("*.rlo"), *(ROOT / "examples").glob("*.rlo")]
    for path in paths:
        content = path.read_bytes()
        if name == "code":
            made = translate(Source(path.name, content.decode())).code
            if made is None:
                continue
            content = assembly(made).encode()
        (folder / f"seed-{path.parent.name}-{path.name}").write_bytes(content)
    return folder


def dictionary() -> Path:
    """Write the words of the language for the mutations."""
    words = sorted(VOCABULARIES[Standard.RLO_2].reserved | {"ARM_1", "XYZ", "ROTZ", "DIST", "INV", "FORCE"})
    path = KEPT / "words.dict"
    path.write_text("".join(f'"{word}"\n' for word in words))
    return path


def main() -> None:
    """Fuzz one target; further arguments are libFuzzer's."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"usage: python fuzz/fuzz.py {{{','.join(TARGETS)}}} [-runs=1000000]")
    name = sys.argv[1]
    test = TARGETS[name]
    folder = seeds(name)
    options = ["-timeout=3", "-rss_limit_mb=2048", "-max_len=4096", f"-dict={dictionary()}", "-print_final_stats=1"]
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={KEPT}/{name}-", *sys.argv[2:], str(folder)], test)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
