"""The page of the studio in the system's Chromium: its first view, the pictures a second while states come, its memory.

``python benchmarks/studio_page.py --minutes 10`` jogs for as long at the end, and tells how the memory grows.
"""

from measure import progress, section, table  # isort: skip - sets the threads first

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from trimesh.creation import uv_sphere

from studio import cell_text, memory, studio

SECONDS = 5.0
CHROMIUM = "/usr/bin/chromium"
# Jogs to and fro, a message each tenth of a second, as a held key sends them.
JOGGING = """(seconds) => new Promise((done) => {
  const begun = performance.now();
  const before = { ...studio.stats };
  const arm = Object.keys(studio.live.state.arms)[0];
  const timer = setInterval(() => {
    const t = (performance.now() - begun) / 1000;
    studio.send({ do: "jog", arm, frame: "JOINT", axis: 0, sign: Math.floor(t) % 2 ? 1 : -1, share: 0.5 }, "jog");
    if (t < seconds) return;
    clearInterval(timer);
    studio.send({ do: "halt" });
    done([(studio.stats.drawn - before.drawn) / t, (studio.stats.states - before.states) / t]);
  }, 90);
})"""


def mesh_cell(folder: Path) -> str:
    """Return a cell with a mesh of more than 100,000 triangles in it."""
    uv_sphere(radius=0.3, count=[230, 230]).export(folder / "ball.stl")
    at = "[1, 0, 0,  0, 1, 0,  0, 0, 1,  0.9, 0.6, 0.3]"
    mesh = f'[[scene.meshes]]\nname = "BALL"\nmesh = "ball.stl"\nunit = "m"\nat = {at}\n'
    return cell_text("puma560", 0) + mesh


def cells(folder: Path) -> dict[str, str]:
    """Return the cells, by what they are."""
    return {
        "one arm": cell_text("puma560", 0),
        "one arm, 20 parts": cell_text("puma560", 20),
        "two arms, 50 parts": cell_text("puma560", 50, arms=2),
        "one arm, 105,800 triangles": mesh_cell(folder),
    }


def renderer_memory() -> float:
    """Return the largest memory of a renderer of Chromium [MB]."""
    found = [0.0]
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if b"--type=renderer" in entry.read_bytes():
                status = (entry.parent / "status").read_text(encoding="utf-8")
                found.append(int(status.partition("VmRSS:")[2].split()[0]) / 1024)
        except OSError:
            continue
    return max(found)


def heap(page: Any) -> float:
    """Return what the script of a page keeps, after its garbage has been collected [MB]."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.enable")
    session.send("HeapProfiler.collectGarbage")
    return float(session.send("Runtime.getHeapUsage")["usedSize"]) / 2**20


def row(browser: Any, title: str, path: Path, minutes: float) -> list[str]:
    """Return the row of a cell; with minutes to jog, how the memory of script and server grows is told."""
    with studio(str(path)) as (process, address, _, _):
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        start = time.perf_counter()
        page.goto(address)
        while not page.evaluate("Boolean(window.studio?.stats.drawn)"):
            time.sleep(0.005)
        first = time.perf_counter() - start
        while not page.evaluate("Boolean(studio.live.state?.ready)"):
            time.sleep(0.05)
        size = page.evaluate("document.documentElement.outerHTML.length") / 1e3
        page.evaluate(JOGGING, 1.0)
        frames, states = page.evaluate(JOGGING, SECONDS)
        cells = [title, f"{first:.2f}", f"{size:.0f}", f"{frames:.0f}", f"{states:.0f}"]
        cells += [f"{heap(page):.1f}", f"{renderer_memory():.0f}", f"{memory(process):.0f}"]
        if minutes:
            before = heap(page), memory(process)
            for _ in range(round(minutes)):
                page.evaluate(JOGGING, 60.0)
            after = heap(page), memory(process)
            grown = [f"{one:.1f} to {two:.1f} MB" for one, two in zip(before, after, strict=True)]
            progress(f"{minutes:g} minutes: script {grown[0]}, server {grown[1]}")
        page.close()
    return cells


def main() -> None:
    """Print the table."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - of the tests

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0)
    minutes = parser.parse_args().minutes
    # The browser has the cores that the server leaves.
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    rows = []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for title, text in cells(Path(folder)).items():
            progress(title)
            path = Path(folder) / "cell.toml"
            path.write_text(text)
            rows.append(row(browser, title, path, minutes if title == "one arm, 20 parts" else 0.0))
        browser.close()
    head = ["cell", "first view, s", "page, kB", "pictures/s", "states/s", "script, MB", "renderer, MB", "server, MB"]
    section(
        "The page of the studio",
        "In headless Chromium without a graphics card, while a joint is jogged.",
        table(head, rows),
    )


if __name__ == "__main__":
    main()
