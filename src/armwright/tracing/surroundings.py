"""What compiled code depends on beside the equation: the sources that make it, the compiler, and the processor.

A later process in the same surroundings takes the code of an equation without tracing it again.
"""

import importlib.util
import os
import sys
from functools import cache
from pathlib import Path

import numpy as np

from armwright.version import __version__

# The package, and its folders in and below the layer of motions: code comes from no other.
_ROOT = Path(__file__).parents[1]
_FOLDERS = ("accuracy", "arm", "compiled", "dynamics", "files", "kinematics", "motion", "simulation", "spatial",
            "sweep", "tracing")  # fmt: skip
# What tells one processor from another, of x86 and of ARM.
_CPUINFO = Path("/proc/cpuinfo")
_OF_PROCESSOR = ("vendor_id", "cpu family", "model", "stepping", "flags", "CPU ", "Features")
_OF_ONE_PROCESSOR = 16_384


def stamp(root: Path = _ROOT) -> str:
    """Describe the sources on the disk by what changes whenever one of them is written; empty where they are no files.

    Args:
        root: the folder of the package.
    """
    lines, folders = list[str](), [str(root), *(f"{root}/{name}" for name in _FOLDERS)]
    try:
        for folder in folders:  # which grows
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.name.endswith(".py"):
                        lines.append(f"{entry.path} {_facts(entry.stat())}")
                    elif folder != folders[0] and entry.is_dir() and entry.name != "__pycache__":
                        folders.append(entry.path)
    except OSError:
        return ""
    return "\n".join(sorted(lines))


def _facts(about: os.stat_result) -> tuple[int, ...]:
    return about.st_size, about.st_mtime_ns, about.st_ctime_ns, about.st_ino


# The modules of this process are those of now, not of when it compiles something.
_AT_START = stamp()


def sources_are_unchanged() -> bool:
    """Whether the sources on the disk are still those that this process runs."""
    return stamp() == _AT_START


@cache
def surroundings() -> str:
    """Describe the surroundings of this process; empty where that is impossible without the compiler."""
    host, compiler = _host(), _compiler()
    if not (_AT_START and host and compiler):
        return ""
    parts = [__version__, sys.version, sys.platform, np.__version__, compiler, host, _AT_START]
    return "\n".join(parts)


def _compiler() -> str:
    found = importlib.util.find_spec("llvmlite")
    if found is None or found.origin is None:
        return ""
    files = [Path(found.origin), *Path(found.origin).parent.glob("binding/*llvmlite*")]
    return "\n".join(f"{file} {_facts(file.stat())}" for file in files)


def _host() -> str:
    try:
        with _CPUINFO.open(encoding="utf-8", errors="replace") as file:
            text = file.read(_OF_ONE_PROCESSOR)
    except OSError:
        return ""
    first, end, _ = text.partition("\n\n")
    lines = [line for line in first.splitlines() if line.startswith(_OF_PROCESSOR)]
    # What NumPy has asked the processor itself: an emulator may have fewer abilities than the machine that it runs on.
    abilities = np.show_config(mode="dicts").get("SIMD Extensions")
    return "\n".join([*lines, str(abilities)]) if end and len(lines) > 1 else ""
