"""The studio over its own connection: how soon it is there, and how fast arms follow a tool that is dragged.

Every arm of the catalogue with six joints stands with a table and twenty parts around it, so that solutions, warnings
and the nearest bodies are worked out for every answer, as when somebody drags. The server and the program that asks it
have a core each where there are two.
"""

from measure import progress, section, table  # isort: skip - sets the threads first

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np

import armwright
from armwright.arm.load import arm_names
from armwright.cli.studio import _bent

EXAMPLES = Path(__file__).parents[1] / "examples"
ROUND_TRIPS, BODIES = 400, 20


class Figures(NamedTuple):
    """What is measured: times [s], the time of each round trip [s], their rate [1/s], memory [MB], the page [kB]."""

    address: float
    ready: float
    trips: np.ndarray
    rate: float
    memory: float
    page: float


def cell_text(name: str, parts: int, arms: int = 1) -> str:
    """Return a cell file with arms, a table below them, and parts on a ring around the first."""
    arm = armwright.load_arm(str(EXAMPLES / name) if name.endswith(".urdf") else name)
    model = name if not name.endswith(".urdf") else str(EXAMPLES / name)
    start = ", ".join(f"{value:.6f}" for value in _bent(arm))
    lines = []
    for k in range(arms):
        base = f"[1, 0, 0,  0, 1, 0,  0, 0, 1,  {3.2 * k}, 0, 0]"
        lines.append(f'[arms.ARM_{k + 1}]\nmodel = "{model}"\nbase = {base}\njoint_positions = [{start}]\n')
    if parts:
        lines.append("[scene.table]\nz = -0.6\nfrom = [-2, -2]\nto = [5, 2]\n")
    for number in range(parts):
        angle = 2 * np.pi * number / parts
        x, y = 1.3 * np.cos(angle), 1.3 * np.sin(angle)
        lines.append(
            f"[parts.BODY_{number}]\nsize_mm = [80, 80, 400]\nmass_kg = 1\n"
            f"at = [1, 0, 0,  0, 1, 0,  0, 0, 1,  {x:.4f}, {y:.4f}, -0.4]\n"
        )
    return "\n".join(lines)


@contextmanager
def studio(*arguments: str):  # noqa: ANN201 - a script
    """Run a studio; give its process, its address, and the times since it began [s] when the address was there."""
    cores = sorted(_all_cores())
    # Modules are compiled once, as when they are installed, whatever the shell says.
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(Path(tempfile.gettempdir()) / "armwright-studio-modules")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "armwright", "studio", *arguments],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: os.sched_setaffinity(0, {cores[0]}),  # noqa: PLW1509 - one thread
    )
    try:
        address = next(iter(process.stdout)).strip()
        yield process, address, time.perf_counter() - began, began
    finally:
        process.terminate()
        process.wait(10)


def _all_cores() -> set[int]:
    return set(range(os.cpu_count() or 1))


def connected(address: str) -> Any:
    """Return a connection to a studio as its page has it."""
    from websockets.sync.client import connect  # noqa: PLC0415 - of the extra

    url = urlsplit(address)
    token = url.query.partition("=")[2]
    return connect(
        f"ws://{url.netloc}/live",
        origin=f"http://{url.netloc}",
        subprotocols=[f"armwright.{token}"],
        compression=None,
        max_size=None,
    )


def memory(process: Any) -> float:
    """Return the memory that a process has [MB]."""
    text = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
    return int(text.partition("VmRSS:")[2].split()[0]) / 1024


def measured(name: str, folder: Path, parts: int) -> Figures:
    """Drag the tool of an arm on a small circle, each step when the last one is answered."""
    path = folder / "cell.toml"
    path.write_text(cell_text(name, parts))
    with studio(str(path)) as (process, address, addressed, began):
        url = urlsplit(address)
        reading = HTTPConnection(url.netloc)
        reading.request("GET", f"{url.path}?{url.query}")
        page = len(reading.getresponse().read())
        with connected(address) as socket:
            state = json.loads(socket.recv())
            while not state["ready"]:
                socket.send('{"do":"got"}')
                state = json.loads(socket.recv(timeout=60))
            ready = time.perf_counter() - began
            pose = np.array(state["arms"]["ARM_1"]["tool"])
            trips, start = [], time.perf_counter()
            for k in range(ROUND_TRIPS):
                goal = pose.copy()
                angle = 2 * np.pi * k / 60
                goal[9:11] += 0.02 * np.array([np.cos(angle) - 1, np.sin(angle)])
                sent = time.perf_counter()
                socket.send(json.dumps({"do": "tool", "arm": "ARM_1", "pose": goal.tolist()}))
                state = json.loads(socket.recv(timeout=60))
                trips.append(time.perf_counter() - sent)
                if state["refusal"]:
                    raise RuntimeError(f"{name}: {state['refusal']}")
            rate = ROUND_TRIPS / (time.perf_counter() - start)
        return Figures(addressed, ready, np.array(trips), rate, memory(process), page / 1e3)


def rows(names: list[str], parts: int) -> list[tuple[str, ...]]:
    """Return a row of the table for each arm."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            progress(name)
            measured(name, Path(folder), parts)
            it = measured(name, Path(folder), parts)
            middle, most = (1e3 * np.percentile(it.trips, share) for share in (50, 95))
            found.append(
                (
                    name,
                    f"{it.address:.2f}",
                    f"{it.ready:.2f}",
                    f"{middle:.1f}",
                    f"{most:.1f}",
                    f"{1e3 * it.trips.max():.1f}",
                    f"{it.rate:.0f}",
                    f"{it.memory:.0f}",
                )
            )
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arms", nargs="*")
    names = parser.parse_args().arms or [
        *(name for name in arm_names() if armwright.load_arm(name).n >= 6),
        "seven_joints.urdf",
    ]
    head = ("arm", "address [s]", "ready [s]", "round trip [ms]", "95 % [ms]", "longest [ms]", "per s", "memory [MB]")
    section(
        "The studio",
        f"A tool that is dragged on a circle, {ROUND_TRIPS} steps of 2 mm, each when the last one is answered, with "
        f"solutions, warnings and the nearest of {BODIES} parts, a table and the arm itself in every answer.",
        table(head, rows(names, BODIES)),
    )


if __name__ == "__main__":
    main()
