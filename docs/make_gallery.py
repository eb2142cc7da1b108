"""The gallery: runs commands, takes the pictures they write, and writes the page; `make gallery` runs this."""

import contextlib
import hashlib
import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from PIL import Image

from armwright.report.svg import alike as drawing_alike

HERE = Path(__file__).parent
ROOT = HERE.parent
PAGE, PICTURES = HERE / "gallery.md", HERE / "gallery"
# What the commands write; kept, so that only what has changed is run again.
OUT = ROOT / "out" / "gallery"
HEAD = """\
# Gallery

What commands write, as they write it. The folder after `-o` holds the picture and more: figures, tables, and where \
there is a page, `report.html`, which opens from the disk. `make gallery` makes this page.
"""
# Of a page: how much of it is shown [px], and how many colours are enough.
WINDOW = {"width": 1280, "height": 860}
COLOURS = 96
# Pictures of a page are one if no point of them differs by more.
SHADE = 16


@attrs.frozen(kw_only=True)
class Exhibit:
    """One picture and what makes it.

    Attributes:
        name: of the picture, and of the folder that the command writes.
        title: heading.
        says: one sentence or two on what is to be seen.
        command: behind ``armwright``; ``-o`` is added. Empty where Python lines make the picture.
        python: lines that write the picture into the folder in which they run; with a command, what it needs.
        shown: the file among the results; ``report.html`` is photographed.
        moment: of a page with a clock, when it is photographed, as a part of its time.
        alt: what the picture shows, in words.
    """

    name: str
    title: str
    says: str
    alt: str
    command: str = ""
    python: str = ""
    shown: str = "report.html"
    moment: float = 0.0

    @property
    def picture(self) -> Path:
        """Where the picture of the page lies."""
        return PICTURES / f"{self.name}{'.png' if self.shown.endswith('.html') else Path(self.shown).suffix}"


FASTEST = """\
from pathlib import Path

import numpy as np

import armwright
from armwright.report.figures import curves

arm = armwright.load_arm("puma560")
through = np.radians([[0, -40, 20, 0, 40, 0], [50, -80, 60, 40, 60, 30], [100, -30, 0, 0, 30, 90]])
slow = armwright.motion.cubic_through([0, 2, 4], through)
fast = armwright.motion.time_optimal(arm, slow).trajectory
t = np.linspace(0, fast.duration, 800)
efforts = armwright.dynamics.inverse_dynamics(arm, fast(t), fast(t, 1), fast(t, 2))
used = {
    "acceleration of joint 1": abs(fast(t, 2))[:, 0] / arm.limits.acceleration[0],
    "acceleration of joint 2": abs(fast(t, 2))[:, 1] / arm.limits.acceleration[1],
    "speed of joint 1": abs(fast(t, 1))[:, 0] / arm.limits.speed[0],
    "effort of joint 2": abs(efforts)[:, 1] / arm.limits.effort[1],
}
title = f"The fastest run along a path: {fast.duration:.2f} s, part of the limits that is used"
Path("fastest.svg").write_text(curves(title, t, used, x_label="time, s", y_label="of the limit"))
"""

EXHIBITS = (
    Exhibit(
        name="gearbox",
        title="A program in the robot language",
        says="A PUMA finds a shaft with its camera and brings it into a gearbox. The page shows the arm moving, the "
        "line of the program that runs, every stage, and position, speed, acceleration and effort of all joints "
        "against their limits.",
        alt="The page of a run: an arm above a table with a shaft in its hand, the program beside it, charts below",
        command="run examples/gearbox.rlo --cell examples/puma_cell.toml",
        moment=0.62,
    ),
    Exhibit(
        name="hand-over",
        title="Two arms on one clock",
        says="Two Stanford arms hand a part over: two processes of one program, which wait for each other.",
        alt="The page of a run with two arms face to face, and the program with two branches",
        command="run examples/hand_over.rlo --cell examples/two_arms.toml",
        moment=0.45,
    ),
    Exhibit(
        name="joint-move",
        title="A joint move",
        says="Every joint moves linearly from configuration to configuration, blended at the middle pose; the tool "
        "swings out.",
        alt="A film of a PUMA that moves through three poses, with the path of its hand",
        command="move joint puma560-seed examples/puma_poses.toml",
        shown="move.gif",
    ),
    Exhibit(
        name="round-the-post",
        title="A Cartesian move",
        says="The tool moves on straight lines from pose to pose and points at a post all the time; the path "
        "comes with a bound of the deviation of the tool between two samples.",
        alt="A path in space of straight segments, blended at two poses, and approach vectors that point to one line",
        command="move cartesian puma560 examples/round_the_post.toml",
        shown="path.svg",
    ),
    Exhibit(
        name="fastest",
        title="The fastest run along a path",
        says="At every moment some joint is at its limit of speed, acceleration or effort; the path stays the same.",
        alt="Curves of the part of the limits that is used over time: at every moment one of two accelerations is at 1",
        python=FASTEST,
        shown="fastest.svg",
    ),
    Exhibit(
        name="stanford-torque",
        title="The torques of 1983",
        says="Figure 7 of report TR-83-008, computed again: the effort of joint 2 in a fast move, by Newton-Euler, by "
        "Bejczy's model, and with the largest load. The study prints a verdict on every constant of the report.",
        alt="Three curves of the effort of joint 2 over one second",
        command="study stanford-torque",
        shown="figure07.svg",
    ),
    Exhibit(
        name="puma-moves",
        title="A move that nobody asked the joints about",
        says="Figure 23 of a project on the PUMA, computed again: the tool moves from A by B to C on straight "
        "lines. The "
        "study then asks what the joints have to do, and finds that they cannot.",
        alt="Position, speed and acceleration of the tool over a second, and its path in space",
        command="study puma-moves",
        shown="figure23.svg",
    ),
    Exhibit(
        name="rattling",
        title="Play in three pins",
        says="Journals half a millimetre smaller than their bearings: they lie at the walls while the arm speeds up "
        "and rattle when it slows down. The page shows the linkage and its bearings moving, errors, forces and the "
        "energy account.",
        alt="The page of a simulated five-bar: the linkage, its three bearings with the paths of the journals, charts",
        command="clearance simulate five-bar --path y1",
        moment=0.9,
    ),
    Exhibit(
        name="corrected",
        title="Moving right in spite of play",
        says="The commanded path of a pick-and-place move corrected, so that the tip reaches its targets.",
        alt="A path with three targets, and the corrected one beside it",
        command="clearance correct five-bar --clearance J2=0.328 --clearance J3=0.171 --clearance J4=0.483",
        shown="paths.svg",
    ),
    Exhibit(
        name="five-bar-study",
        title="729 linkages",
        says="Figure 4.18 of a thesis on play, computed again from 2187 simulations: what one feature of the error "
        "curve says of the play in two pins. The study goes on to two arms told apart and a path corrected.",
        alt="A surface of the intercept over the play of two pins, rising towards both",
        command="study five-bar-clearance",
        shown="figure4.18.svg",
    ),
    Exhibit(
        name="calibration",
        title="A better arm from measured points",
        says="Points that a laser tracker would measure of a PUMA: a millimetre of error as drawn, half a millimetre "
        "with "
        "its geometry calibrated, and within its repeatability with joint compliance under gravity, which "
        "held-out points confirm. Errors that are not identifiable from the points are named.",
        alt="How many of the readings are nearer than a distance: before, calibrated, and with joint compliance",
        command="calibrate puma560-seed examples/puma_points.csv --beyond",
        shown="distances.svg",
    ),
    Exhibit(
        name="board",
        title="An arm calibrated on a board",
        says="Errors at six positions before, after the fit of a thesis, and after a fit of all identifiable errors.",
        alt="Groups of bars at six positions on a logarithmic scale, the last a hundred times lower than the first",
        command="study dh-calibration",
        shown="verification.svg",
    ),
    Exhibit(
        name="iso9283",
        title="Accuracy by ISO 9283",
        says="Measured poses and paths in, accuracy and repeatability out, every measure with its number of cycles; "
        "here the clouds that two of them come from.",
        alt="A cloud of thirty poses beside the commanded one, seen twice, with the circle of the repeatability",
        command="iso9283 examples/measured_poses.csv examples/measured_paths.csv",
        shown="01-pose.svg",
    ),
)
# Drawn by docs/pictures/make.py for the pages on physics.
ALSO = {
    "pictures/postures.svg": "[All joint configurations of a PUMA for one pose](physics/kinematics.md)",
    "pictures/released.svg": "[Where the energy of a released arm goes](physics/dynamics.md)",
    "pictures/two_moves.svg": "[A joint move and a Cartesian move](physics/motion.md)",
    "pictures/rattling.svg": "[Journals in their bearings](physics/clearance.md)",
}


def state(exhibit: Exhibit) -> str:
    """Return a name for all that a picture depends on: the exhibit, the package, the examples."""
    found = hashlib.sha256(repr(exhibit).encode())
    for folder, pattern in (("src/armwright", "*.py"), ("src/armwright", "*.toml"), ("examples", "*")):
        for path in sorted((ROOT / folder).rglob(pattern)):
            if path.is_file() and "__pycache__" not in path.parts:
                found.update(path.read_bytes())
    for asset in sorted((ROOT / "src/armwright/report/assets").iterdir()):
        found.update(asset.read_bytes())
    return found.hexdigest()


def made(exhibit: Exhibit) -> bool:
    """Run the command of an exhibit and take its picture, unless both are there; return whether anything was done."""
    folder, now = OUT / exhibit.name, state(exhibit)
    stamp = OUT / f"{exhibit.name}.state"
    if exhibit.picture.exists() and stamp.exists() and stamp.read_text(encoding="utf-8") == now:
        return False
    folder.mkdir(parents=True, exist_ok=True)
    if exhibit.python:
        with contextlib.chdir(ROOT if exhibit.command else folder):
            exec(exhibit.python, {})  # noqa: S102 - the lines above
    if exhibit.command:
        command = [sys.executable, "-m", "armwright", *exhibit.command.split(), "-o", str(folder.relative_to(ROOT))]
        subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)  # noqa: S603 - our own commands
    PICTURES.mkdir(exist_ok=True)
    if exhibit.shown.endswith(".html"):
        if not photographed(folder / exhibit.shown, exhibit.picture, exhibit.moment):
            return True
    else:
        copied(folder / exhibit.shown, exhibit.picture)
    stamp.write_text(now, encoding="utf-8")
    return True


def copied(drawn: Path, picture: Path) -> None:
    """Take a picture from among results, unless the one that is there is the same but for rounding."""
    if drawn.suffix == ".svg" and picture.exists():
        new, old = (path.read_text(encoding="utf-8") for path in (drawn, picture))
        if drawing_alike(new, old):
            return
    shutil.copyfile(drawn, picture)


def photographed(page: Path, picture: Path, moment: float) -> bool:
    """Open a page in the system's browser and keep what is seen; return False where there is no browser."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        sys.stderr.write(f"no chromium on this machine: {picture.name} stays as it was\n")
        return False
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - not needed for figures

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--headless", "--no-sandbox"])
        shown = browser.new_page(viewport=WINDOW)
        shown.goto(page.resolve().as_uri())
        shown.wait_for_timeout(500)
        if moment:
            shown.evaluate(_SET_CLOCK, moment)
            shown.wait_for_timeout(500)
        photo = shown.screenshot()
        browser.close()
    keep(photo, picture)
    return True


_SET_CLOCK = """(moment) => {
    const time = document.getElementById("time");
    time.value = moment * Number(time.max);
    time.dispatchEvent(new Event("input"));
}"""


def keep(photo: bytes, picture: Path) -> None:
    """Write a picture with few colours, which is a third of the bytes."""
    image: Any = Image.open(io.BytesIO(photo)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    if picture.exists() and alike(image, Image.open(picture)):
        return
    image.save(picture, optimize=True)


def alike(new: Any, old: Any) -> bool:
    """Whether two pictures are one but for shades, which come out a little otherwise each time."""
    if new.size != old.size:
        return False
    apart = np.abs(np.asarray(new.convert("RGB"), dtype=int) - np.asarray(old.convert("RGB"), dtype=int)).max(axis=2)
    return bool(apart.max() <= SHADE)


def lines() -> Iterator[str]:
    """Give the lines of the page."""
    yield HEAD
    for exhibit in EXHIBITS:
        yield f"## {exhibit.title}\n"
        yield f"![{exhibit.alt}]({exhibit.picture.relative_to(HERE)})\n"
        yield f"{exhibit.says}\n"
        if exhibit.python:
            yield f"```python\n{exhibit.python}```\n"
        if exhibit.command:
            yield f"    armwright {exhibit.command} -o out/{exhibit.name}\n"
            yield f"<!-- page {exhibit.name} -->\n"
    yield "## And\n"
    for picture, link in ALSO.items():
        yield f"- {link}: [picture]({picture})"


def text() -> str:
    """Return the page."""
    return "\n".join(lines()).rstrip() + "\n"


if __name__ == "__main__":
    for exhibit in EXHIBITS:
        if made(exhibit):
            sys.stderr.write(f"{exhibit.name}: made\n")
    PAGE.write_text(text(), encoding="utf-8")
