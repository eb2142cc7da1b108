"""Compiled functions on disk: found by the next process, mended whatever happened to them, never trusted unchecked."""

import math
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import armwright
from armwright.files.store import Store
from fork_server import ForkServer, fork_server
from samples import Sample

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

SOURCES = str(Path(armwright.__file__).parents[1])
VALUE = repr(math.sin(0.5) * 1.25)

_START = """
import sys
import numpy as np
from armwright.tracing import native
from armwright.tracing.emit import emit
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import sin
compile_ir, compiled = native._compile, []
native._compile = lambda ir, **how: compiled.append(ir) or compile_ir(ir, **how)
kernel = Kernel(emitted=emit("wave", lambda x: [[sin(x[0]) * 1.25]], {"x": 1}))
print(repr(float(kernel(np.array([0.5]))[0])), int(not compiled))
"""


# The same wave in a loop that Numba compiles.
_START_LOOP = """
import numpy as np
from armwright.tracing.cache import compiled
SOURCE = '''
import math
from numba import float64, types
SIGNATURE = types.void(types.Array(float64, 1, "C"))
def wave(x):
    for i in range(len(x)):
        x[i] = math.sin(x[i]) * 1.25
'''
x, wave = np.array([0.5]), compiled(SOURCE, "wave", "a wave")
wave(x)
print(repr(float(x[0])), len(wave.stats.cache_hits))
"""


def _environment(cache: Path | None) -> dict[str, str]:
    environment = {name: os.environ[name] for name in ("PATH", "TMPDIR") if name in os.environ}
    environment |= {"PYTHONPATH": SOURCES, "PYTHONDONTWRITEBYTECODE": "1"}
    return environment if cache is None else environment | {"ARMWRIGHT_CACHE": str(cache)}


def starting(cache: Path) -> subprocess.Popen[str]:
    """Start a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", _START],
        env=_environment(cache),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    """A process that has loaded the compilers, and compiled nothing."""
    with fork_server(
        ["numpy", "armwright.tracing.emit", "armwright.tracing.kernel", "llvmlite.binding", "numba"], _environment(None)
    ) as server:
        yield server


@pytest.fixture
def start(server: ForkServer, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Return what starts a process without a word on the error output.

    It returns how often that found what was compiled before: "0" or "1".
    """
    scratch = tmp_path_factory.mktemp("scratch")

    def started(cache: Path, *, cwd: Path = scratch, code: str = _START, **more: Any) -> str:
        answer = server.call(cwd, scratch, code=code, environment=_environment(cache), **more)
        assert (answer["status"], answer["err"]) == (0, "")
        value, hits = answer["out"].split()
        assert value == VALUE
        return str(hits)

    return started


@pytest.fixture(scope="module")
def stored(server: ForkServer, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache that holds the compiled kernel."""
    cache = tmp_path_factory.mktemp("cache")
    server.call(cache, tmp_path_factory.mktemp("scratch"), code=_START, environment=_environment(cache))
    return cache


def entries(cache: Path) -> list[Path]:
    return [path for path in (cache / "compiled").iterdir() if path.suffix != ".lock"]


def test_second_start_compiles_nothing(tmp_path: Path, start: Callable[..., str]) -> None:
    """Another process finds the compiled kernel on the disk: one file, for the user alone, and no source."""
    assert [start(tmp_path), start(tmp_path)] == ["0", "1"]

    (entry,) = entries(tmp_path)
    assert entry.stat().st_mode & 0o777 == 0o600
    assert [path.name for path in tmp_path.iterdir()] == ["compiled"]


def test_processes_that_start_together(tmp_path: Path) -> None:
    """Three processes that want the same kernel at once all get it, and one of them compiles it."""
    running = [starting(tmp_path) for _ in range(3)]
    said = [process.communicate(timeout=300)[0].split() for process in running]

    assert {line[0] for line in said} == {VALUE}
    assert sum(line[1] == "0" for line in said) == 1


def _half(data: bytes) -> bytes:
    return data[: len(data) // 2]


def _flipped(data: bytes) -> bytes:
    return data[:-9] + bytes([data[-9] ^ 1]) + data[-8:]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut off": _half,
    "empty": lambda _: b"",
    "foreign": lambda _: b"\x7fELF and so on",
    "one bit": _flipped,
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
@pytest.mark.drawn(0.34)
def test_damage_is_mended_without_a_word(
    tmp_path: Path, stored: Path, damage: Callable[[bytes], bytes], start: Callable[..., str]
) -> None:
    """After any damage the kernel is compiled again, and the start after that finds it."""
    cache = shutil.copytree(stored, tmp_path / "cache")
    (entry,) = entries(cache)
    entry.write_bytes(damage(entry.read_bytes()))

    assert [start(cache), start(cache)] == ["0", "1"]


def test_sound_bytes_that_are_no_function(tmp_path: Path, stored: Path, start: Callable[..., str]) -> None:
    """An entry that is whole, but of a compiler that wrote otherwise, is made anew too."""
    cache = shutil.copytree(stored, tmp_path / "cache")
    (entry,) = entries(cache)
    Store(entry.parent).put(entry.name, pickle.dumps((b"no code", b"no function")))

    assert [start(cache), start(cache)] == ["0", "1"]


class _Poison:
    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return os.mkdir, ("PWNED",)


def test_poison_is_not_loaded(tmp_path: Path, stored: Path, start: Callable[..., str]) -> None:
    """Code that somebody put in the place of an entry does not run: neither a pickle nor a source nor a bytecode."""
    cache = shutil.copytree(stored, tmp_path / "cache")
    (entry,) = entries(cache)
    sound = entry.read_bytes()
    poison = pickle.dumps(_Poison())
    old = cache / "kernels" / entry.name[:32]
    old.mkdir(parents=True)
    (old / "kernel.py").write_text("import os; os.mkdir('PWNED')")

    for bad in (poison, sound[:50] + poison, sound + poison, sound[:18] + bytes(32) + poison):
        entry.write_bytes(bad)
        assert start(cache, cwd=tmp_path) == "0"
    assert not (tmp_path / "PWNED").exists()


def test_files_may_not_grow(tmp_path: Path, start: Callable[..., str]) -> None:
    """Where files may not grow, as with ulimit -f, the kernel is compiled for the process alone, and kept later."""
    assert start(tmp_path, file_size=128) == "0"
    assert entries(tmp_path) == []
    assert [start(tmp_path), start(tmp_path)] == ["0", "1"]


@pytest.mark.share(0.034)
def test_killed_while_compiling(tmp_path: Path, sample: Sample, start: Callable[..., str]) -> None:
    """Whenever a process is killed, the next one finds a whole entry or none."""
    killed = 0
    for rng in sample.cases(30):
        shutil.rmtree(tmp_path / "compiled", ignore_errors=True)
        process = starting(tmp_path)
        time.sleep(float(rng.uniform(0.1, 0.6)))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        start(tmp_path)
        assert start(tmp_path) == "1"
        killed += 1
    sample.record("processes killed while they compiled: later starts that failed", killed, 0)


def test_a_file_for_a_cache(tmp_path: Path, start: Callable[..., str]) -> None:
    """Where the cache folder is a file, the kernel is compiled for the process alone."""
    (tmp_path / "file").write_text("in the way")

    assert start(tmp_path / "file") == "0"


def test_loops_of_numba(tmp_path: Path, start: Callable[..., str]) -> None:
    """What Numba compiled is found too, made anew after any damage, and no foreign code runs in its place."""
    cache = tmp_path / "cache"
    assert [start(cache, code=_START_LOOP), start(cache, code=_START_LOOP)] == ["0", "1"]
    (entry,) = entries(cache)
    sound, poison = entry.read_bytes(), pickle.dumps(_Poison())

    for bad in (_flipped(sound), poison, sound[:50] + poison):
        entry.write_bytes(bad)
        assert start(cache, code=_START_LOOP, cwd=tmp_path) == "0"
    Store(entry.parent).put(entry.name, pickle.dumps((b"no code", b"no function")))
    assert [start(cache, code=_START_LOOP), start(cache, code=_START_LOOP)] == ["0", "1"]
    assert not (tmp_path / "PWNED").exists()
