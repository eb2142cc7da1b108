"""Completion of commands, options and files in a shell, and what --help shows."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
import typer.main
from typer.testing import CliRunner

from armwright.cli.app import app
from armwright.cli.shell_completion import Shell, script
from cli_calls import armwright


def all_commands(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Give every command by the words that call it, that of the program itself among them."""
    yield path, group
    for name, command in getattr(group, "commands", {}).items():
        yield from all_commands(command, (*path, name))


def offered(*words: str, cwd: Path | None = None) -> list[str]:
    """Return what the last word may become, as bash is told."""
    asked = {
        "_ARMWRIGHT_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(["armwright", *words]),
        "COMP_CWORD": str(len(words)),
    }
    done = armwright(cwd=cwd, environment=asked)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.mark.parametrize("path", [path for path, _ in all_commands(typer.main.get_command(app))], ids=" ".join)
def test_help_shows_flags_without_a_type(path: tuple[str, ...]) -> None:
    """What takes no value is shown without one."""
    shown = CliRunner().invoke(app, [*path, "--help"]).output

    assert "--help" in shown
    assert "bool" not in shown.lower()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("f",), ["fmt", "fix", "forward"]),
        (("clearance", "e"), ["estimate"]),
        (("run", "--c"), ["--cell"]),
        (("forward", "stanford"), ["stanford", "stanford-jpl"]),
        (("calibrate", "puma"), ["puma560", "puma560-seed"]),
        (("clearance", "simulate", "five"), ["five-bar"]),
        (("clearance", "simulate", "five-bar", "--law", "flo"), ["flores"]),
        (("clearance", "correct", "five-bar", "--path", "pick"), ["pick-and-place"]),
        (("move", "c"), ["cartesian"]),
        (("run", "p.rlo", "--around", "d"), ["damped"]),
        (("explain", "E40"), ["E401", "E402", "E403", "E404"]),
        (("kernel", "ur5", "mass"), ["mass_matrix"]),
        (("study", "p"), ["puma-moves"]),
        (("jacobian", "ur5", "--frame", "t"), ["tool"]),
        (("--raise", "table_m"), ["table_mb="]),
    ],
)
def test_words_are_completed(words: tuple[str, ...], told: list[str], tmp_path: Path) -> None:
    """Commands, options, arms and every word that an option knows are completed."""
    found = offered(*words, cwd=tmp_path)

    assert found == told or set(told) <= set(found), found
    assert all(word.lower().startswith(words[-1].lower()) for word in found)


def test_files_are_completed(tmp_path: Path) -> None:
    """A file stands beside the arms that begin like it; all other paths are left to the shell."""
    (tmp_path / "ur5_mine.toml").touch()
    (tmp_path / "ur5s").mkdir()

    assert offered("show", "ur5", cwd=tmp_path)[-2:] == ["ur5_mine.toml", "ur5s/"]
    assert offered("show", "./ur", cwd=tmp_path) == []
    assert offered("run", "", cwd=tmp_path) == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_bash_completes_a_word(tmp_path: Path) -> None:
    """Bash reads the script and fills in what fits."""
    program = tmp_path / "armwright"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m armwright "$@"\n')
    program.chmod(0o755)
    asked = (
        'eval "$(armwright --show-completion bash)"; COMP_WORDS=(armwright arm); COMP_CWORD=1; '
        '_armwright_completion armwright; echo "${COMPREPLY[@]}"; complete -p armwright'
    )
    path = f"{tmp_path}:{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", asked],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PATH": path},
        timeout=120,
    )

    assert done.stdout.splitlines() == ["arms", "complete -o default -F _armwright_completion armwright"], done


@pytest.mark.parametrize("shell", get_args(Shell))
def test_each_shell_has_a_script(shell: Shell) -> None:
    """Every shell has a script, which asks by the variable that the program listens to."""
    assert "_ARMWRIGHT_COMPLETE" in script(shell)


@pytest.mark.parametrize(
    ("shell", "file"),
    [
        ("bash", ".bash_completions/armwright.sh"),
        ("zsh", ".zfunc/_armwright"),
        ("fish", ".config/fish/completions/armwright.fish"),
    ],
)
def test_script_is_installed_where_the_shell_looks(
    shell: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The script goes where the shell looks for it, and its place is said."""
    monkeypatch.setenv("HOME", str(tmp_path))

    done = CliRunner().invoke(app, ["--install-completion", shell])

    assert done.exit_code == 0
    assert str(tmp_path / file) in done.output.replace("\n", "")
    assert "_ARMWRIGHT_COMPLETE" in (tmp_path / file).read_text()


def test_pipe_in_place_of_a_start_up_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody waits for a pipe where a shell has its start-up file."""
    os.mkfifo(tmp_path / ".bashrc")
    monkeypatch.setenv("HOME", str(tmp_path))

    done = armwright("--install-completion", "bash")

    assert done.returncode == 4
    assert ".bashrc: expected a file, got a pipe" in done.stderr


def test_start_up_file_that_is_no_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start-up files that are no text are left alone, and the script can be had otherwise."""
    (tmp_path / ".bashrc").write_bytes(b"\xff\xfe")
    monkeypatch.setenv("HOME", str(tmp_path))

    done = armwright("--install-completion", "bash")

    assert done.returncode == 4
    assert "--show-completion bash prints its script" in done.stderr
    assert (tmp_path / ".bashrc").read_bytes() == b"\xff\xfe"


def test_unknown_shell() -> None:
    """A shell that there is not is answered with those there are."""
    done = armwright("--show-completion", "tcsh")

    assert done.returncode == 2
    assert "'bash', 'zsh', 'fish', 'powershell'" in " ".join(done.stderr.replace("│", " ").split())


def test_help_loads_little() -> None:
    """--help waits for nothing that only a command needs."""
    heavy = "{'numpy', 'scipy', 'attr', 'matplotlib', 'pygments', 'numba'}"
    code = f"import sys; from armwright.cli import app; print(sorted({heavy} & set(sys.modules)))"

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)

    assert done.stdout == "[]\n", done
