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

Figures and pages that the commands write, unchanged. The folder after `-o` contains the picture and further files: \
figures, tables and, for some commands, the page `report.html`, which needs no network. `make gallery` generates this \
page.
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
        name: name of the picture and of the folder that the command writes.
        title: heading on the page.
        says: one or two sentences that describe the picture.
        command: arguments of ``armwright`` without ``-o``; empty if Python lines write the picture.
        python: lines that write the picture into the folder in which they run; with a command, what it needs.
        shown: the file among the results; ``report.html`` is photographed.
        moment: time of the screenshot of an animated page, as a fraction of its duration.
        alt: description of the picture for readers who cannot see it.
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
        says="A PUMA locates a shaft with its camera and inserts it into a gearbox. The page shows the animated arm, "
        "the current line of the program, every motion stage, and position, velocity, acceleration and effort of all "
        "joints with their limits.",
        alt="The page of a run: its numbers, an arm with a shaft in its gripper, the program and the joints beside it",
        command="run examples/gearbox.rlo --cell examples/puma_cell.toml",
        moment=0.62,
    ),
    Exhibit(
        name="hand-over",
        title="Two arms on one clock",
        says="Two Stanford arms hand over a part. Two processes of one program control them and wait for each other.",
        alt="The page of a run with two arms face to face, and the program with two branches",
        command="run examples/hand_over.rlo --cell examples/two_arms.toml",
        moment=0.45,
    ),
    Exhibit(
        name="joint-move",
        title="A joint move",
        says="Every joint moves linearly from configuration to configuration, with a blend at the middle pose; the "
        "tool deviates from the straight line.",
        alt="A film of a PUMA that moves through three poses, with the path of its tool",
        command="move joint puma560-seed examples/puma_poses.toml",
        shown="move.gif",
    ),
    Exhibit(
        name="round-the-post",
        title="A Cartesian move",
        says="The tool moves along straight lines from pose to pose and always points at a post. The certificate of "
        "the motion bounds the path deviation of the tool, also between samples.",
        alt="A path in space of straight segments, blended at two poses, and approach vectors that point to one line",
        command="move cartesian puma560 examples/round_the_post.toml",
        shown="path.svg",
    ),
    Exhibit(
        name="fastest",
        title="Time-optimal motion along a path",
        says="At every time one joint is at its limit of velocity, acceleration or effort. The path is unchanged.",
        alt="Curves of the used share of the limits over time: at every time one of two accelerations is at 1",
        python=FASTEST,
        shown="fastest.svg",
    ),
    Exhibit(
        name="stanford-torque",
        title="Joint torques of the Stanford arm",
        says="Figure 7 of report TR-83-008, computed again: the effort of joint 2 in a fast move, by Newton-Euler, by "
        "Bejczy's model, and with the largest load. The study assesses every constant that the report prints.",
        alt="Three curves of the effort of joint 2 over one second",
        command="study stanford-torque",
        shown="figure07.svg",
    ),
    Exhibit(
        name="puma-moves",
        title="A Cartesian move beyond the joint limits",
        says="Figure 23 of a project on the PUMA, computed again: the tool moves from A by B to C along straight "
        "lines. The study then computes the joint motion, and finds that it exceeds the joint limits.",
        alt="Position, speed and acceleration of the tool over a second, and its path in space",
        command="study puma-moves",
        shown="figure23.svg",
    ),
    Exhibit(
        name="rattling",
        title="Clearance in three pins",
        says="The radii of the journals are half a millimetre smaller than those of their bearings. The journals stay "
        "in contact while the arm accelerates, and bounce when it decelerates. The page animates the linkage and its "
        "bearings, and shows errors, forces and the energy balance.",
        alt="The page of a simulated five-bar: the linkage, its three bearings with the paths of the journals, charts",
        command="clearance simulate five-bar --path y1",
        moment=0.9,
    ),
    Exhibit(
        name="corrected",
        title="Compensation of joint clearance",
        says="The commanded path of a pick-and-place move corrected, so that the tip reaches its targets.",
        alt="A path with three targets, and the corrected one beside it",
        command="clearance correct five-bar --clearance J2=0.328 --clearance J3=0.171 --clearance J4=0.483",
        shown="paths.svg",
    ),
    Exhibit(
        name="five-bar-study",
        title="729 linkages",
        says="Figure 4.18 of a thesis on joint clearance, computed again from 2187 simulations: one feature of the "
        "error curve as a function of the clearances of two pins. The study also estimates the clearances of two arms "
        "and corrects a path.",
        alt="A surface of the intercept over the clearances of two pins, which increases with both",
        command="study five-bar-clearance",
        shown="figure4.18.svg",
    ),
    Exhibit(
        name="worn",
        title="Worn pins",
        says="Archard's law takes material from bearings and journals where the motion presses them. The profiles are "
        "magnified; the command prints how many strokes the tip stays within a limit, with half the steps beside.",
        alt="Three pins: round circles, and the worn profiles of bearing and journal, lobes on one side of each",
        command="clearance wear five-bar --path pick-and-place --clearance J2=0.328 --clearance J3=0.171 "
        "--clearance J4=0.483 --k 1e-5 --limit-ap 0.7",
        shown="profiles.svg",
    ),
    Exhibit(
        name="failure",
        title="The life of an arm with play",
        says="Clearances and the wear coefficient are known with their spread. The probability that the error of the "
        "tip has passed 1 mm increases with the strokes; one in ten arms has passed it at B10.",
        alt="A curve of the probability of failure over the strokes, with a band and the points B10 and B50",
        command="clearance reliability five-bar --path pick-and-place --poses 5 --clearance J2=0.328 "
        "--clearance J3=0.171 --clearance J4=0.483 --limit 1 --k 1e-5",
        shown="failure-error.svg",
    ),
    Exhibit(
        name="calibration",
        title="Calibration from measured points",
        says="Simulated laser-tracker measurements of a PUMA: the residuals are about one millimetre with the nominal "
        "geometry, half a millimetre with the calibrated geometry, and at the level of the repeatability with joint "
        "compliance under gravity, which held-out points confirm. Unidentifiable errors are listed.",
        alt="Cumulative share of the readings over the residual: nominal, calibrated, and with joint compliance",
        command="calibrate puma560-seed examples/puma_points.csv --beyond",
        shown="distances.svg",
    ),
    Exhibit(
        name="board",
        title="Calibration by a board",
        says="Position errors at six points: nominal, after the calibration of a thesis, and after a calibration of "
        "all identifiable errors.",
        alt="Groups of bars at six positions on a logarithmic scale, the last a hundred times lower than the first",
        command="study dh-calibration",
        shown="verification.svg",
    ),
    Exhibit(
        name="iso9283",
        title="Accuracy according to ISO 9283",
        says="The command computes accuracy and repeatability from measured poses and paths, each characteristic with "
        "its number of cycles. The figure shows the attained poses of one test.",
        alt="Thirty attained poses beside the commanded pose, in two projections, and their distances from the middle",
        command="iso9283 examples/measured_poses.csv examples/measured_paths.csv",
        shown="01-pose.svg",
    ),
)
# Drawn by docs/pictures/make.py for the pages on physics.
ALSO = {
    "pictures/postures.svg": "[All IK solutions of a PUMA for one pose](physics/kinematics.md)",
    "pictures/released.svg": "[Energy balance of the free response of an arm](physics/dynamics.md)",
    "pictures/two_moves.svg": "[A joint move and a Cartesian move](physics/motion.md)",
    "pictures/rattling.svg": "[Journals in bearings with clearance](physics/clearance.md)",
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
    yield "## Further figures\n"
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
