"""The command kernel: quantities of an arm in other languages."""

import json
import subprocess
from pathlib import Path

import pytest

from armwright.arm.load import load_arm
from armwright.compiled.source_text import source_text
from cli_calls import armwright
from oracles.compilers import build


@pytest.mark.parametrize("language", ["c", "cpp", "cuda"])
def test_languages(language: str, tmp_path: Path) -> None:
    """Text for another compiler is printed alone, or written to a file, and JSON has it with the operation counts."""
    expected = source_text(load_arm("stanford"), ["forward", "jacobian"], language)  # type: ignore[arg-type]
    command = ("kernel", "stanford", "forward,jacobian", "--language", language)

    printed = armwright(*command)
    written = armwright(*command, "-o", tmp_path / "new" / "text.h")
    data = json.loads(armwright(*command, "--json").stdout)

    assert (printed.returncode, printed.stdout, printed.stderr) == (0, expected, "")
    assert written.stdout == f"forward, jacobian of stanford written to {tmp_path / 'new' / 'text.h'}\n"
    assert (tmp_path / "new" / "text.h").read_text(encoding="ascii") == expected
    assert (data["language"], data["source"], data["total"]) == (language, expected, sum(data["operations"].values()))
    assert "jacobian of stanford: " in armwright(*command, "--count").stdout


def test_program_that_tests_itself(tmp_path: Path) -> None:
    """With --test the text is a program, which says of every quantity how far off it is and ends with 0."""
    command = ("kernel", "ur5", "inverse_dynamics,mass_matrix", "--language", "c", "--real", "float", "--test")
    done = armwright(*command, "-o", tmp_path / "ur5.c")

    assert (done.returncode, done.stderr) == (0, "")
    program = build("gcc", (tmp_path / "ur5.c").read_text(encoding="ascii"), tmp_path / "program")
    ran = subprocess.run([program], capture_output=True, text=True, check=False)
    assert ran.returncode == 0
    assert [line.partition(":")[0] for line in ran.stdout.splitlines()] == [
        "ur5_inverse_dynamics_float",
        "ur5_mass_matrix_float",
    ]


def test_output_to_a_dash(tmp_path: Path) -> None:
    """A dash is no file name: the message names what is."""
    done = armwright("kernel", "ur5", "forward", "-o", "-", cwd=tmp_path)

    assert done.returncode != 0
    assert "cannot write '-': expected the name of a file, or /dev/stdout for the standard output" in done.stderr
    assert not list(tmp_path.iterdir())


def test_llvm_to_a_file(tmp_path: Path) -> None:
    """LLVM IR is written to a file too."""
    done = armwright("kernel", "ur5", "forward", "-o", tmp_path / "forward.ll")

    assert done.returncode == 0
    assert "define i64 @rows(" in (tmp_path / "forward.ll").read_text()


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (("forward", "--language", "rust"), 2, "'rust' is not one of 'llvm', 'c', 'cpp', 'cuda'"),
        (("forward", "--language", "c", "--real", "half"), 2, "'half' is not one of 'double', 'float'"),
        (("forward", "--real", "float"), 2, "expected double for llvm, got float; --language c and cpp have float"),
        (("forward", "--language", "cuda", "--real", "float"), 2, "expected double for cuda, got float"),
        (("forward", "--language", "cpp", "--real", "float"), 2, "expected --test with float"),
        (("forward,jacobian",), 2, "expected one with --language llvm; c, cpp and cuda have several in one text"),
        (("forward", "--test"), 2, "expected --language c or cpp, got llvm"),
        (("forward", "--language", "cuda", "--test"), 2, "expected --language c or cpp, got cuda"),
        (("forward", "--language", "c", "--single"), 2, "expected --language llvm, got c"),
        (("forward,jacobain", "--language", "c"), 2, "no quantity 'jacobain'. Did you mean 'jacobian'?"),
        (("forward,forward", "--language", "c"), 2, "quantities: expected each once, got forward twice"),
        (("inverse_branches", "--language", "c", "--real", "float"), 2, "real: expected double for inverse_branches"),
    ],
)
def test_refusals(options: tuple[str, ...], status: int, message: str) -> None:
    """What a language does not have is refused with what it has."""
    done = armwright("kernel", "ur5", *options)

    assert (done.returncode, done.stdout) == (status, "")
    assert message in " ".join(done.stderr.replace("│", " ").split())


def test_input_is_not_overwritten(tmp_path: Path) -> None:
    """The file of the arm is not written over."""
    armwright("convert", "ur5", "-o", tmp_path / "mine.toml")
    before = (tmp_path / "mine.toml").read_bytes()

    done = armwright("kernel", tmp_path / "mine.toml", "forward", "--language", "c", "-o", tmp_path / "mine.toml")

    assert done.returncode != 0
    assert "it is an input of this command" in done.stderr
    assert (tmp_path / "mine.toml").read_bytes() == before
