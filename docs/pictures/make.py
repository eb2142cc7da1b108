"""The pictures of the physics pages and of the tutorial on the studio; `make pictures` runs this."""

import io
import runpy
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from follow import Session
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from armwright.arm import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.assessment import assess_calibration
from armwright.calibration.measurements import read_measurements
from armwright.clearance.ideal import point_position, tip_position
from armwright.clearance.linkage import BodyPoint
from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.simulation import Simulation as Rattling, simulate as simulate_play
from armwright.kinematics import forward, inverse, link_poses
from armwright.kinematics.inverse_kinematics.solution import Branch
from armwright.motion.plan import Manner, StageGoal, plan
from armwright.report.calibration_files import distances_figure
from armwright.report.svg import alike, normalize_svg
from armwright.simulation import simulate
from armwright.simulation.integrators import Adaptive
from armwright.simulation.result import Event, JointState, Simulation
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.study import puma_moves

HERE = Path(__file__).parent
INK, FAINT, GRID, ALARM = "#1f2933", "#7b8794", "#e4e7eb", "#c62828"
# Fixed names of the parts, no date: a picture changes only when its numbers do. White behind, for dark pages too.
STYLE = {
    "svg.hashsalt": "armwright",
    "figure.facecolor": "white",
    "font.size": 9,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "path.simplify_threshold": 0.5,
}


def write(figure: Figure, name: str) -> None:
    """Write a figure beside this script, unless the one that is there is the same but for rounding."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    picture, new = HERE / name, normalize_svg(text.getvalue())
    if not (picture.exists() and alike(new, picture.read_text(encoding="utf-8"))):
        picture.write_text(new, encoding="utf-8")


# The eight postures.

# The hand, pointing forward and down: where the wrist centre is [m], and roll, pitch and yaw [deg].
PLACE, TURN = (0.36, 0.02, -0.05), (120, -25, 90)
# From where the arm is seen: around from the front, and up [rad].
AROUND, UP = np.radians(-62), np.radians(22)
FLOOR = -0.45  # below the shoulder [m]
COLOURS = {"left": ("#1d6fa5", "#8fc1e3"), "right": ("#b45309", "#f3b26b")}
CONFIGURATIONS = ("up, no-flip", "up, flip", "down, no-flip", "down, flip")


def seen(p: Array) -> Array:
    """Return where points (..., 3) are on the picture: right, up, and towards who looks (..., 3)."""
    c, s, cu, su = np.cos(AROUND), np.sin(AROUND), np.cos(UP), np.sin(UP)
    return p @ np.array([[-s, c, 0], [-su * c, -su * s, cu], [cu * c, cu * s, su]]).T


def bar_chart(arm: Arm, q: Array) -> list[tuple[Array, Array, float, int]]:
    """Return the arm as straight bars: ends [m], width [points], and a part: column, arm, hand, axis of joint 5."""
    X = link_poses(arm, q)
    shoulder, elbow, wrist = X[1, :3, 3], X[2, :3, 3], X[4, :3, 3]
    # The table has the shoulder's offset beside joint 3; built it is beside joint 2. The axes are the same.
    side = arm.joints[2].d * X[2, :3, 2]
    R, pin = X[6, :3, :3], X[4, :3, 2]
    palm = wrist + 0.10 * R[:, 2]
    fingers = [(palm + w * R[:, 0], palm + w * R[:, 0] + 0.07 * R[:, 2], 3.5, 2) for w in (-0.04, 0.04)]
    return [
        (np.array((0, 0, FLOOR)), shoulder, 18, 0),
        (shoulder - 0.3 * side, shoulder + side, 15, 0),
        (shoulder + side, elbow + side, 13, 1),
        (elbow + side, wrist, 10, 1),
        (wrist, wrist + 0.13 * pin, 2.5, 3),
        (wrist + 0.13 * pin, wrist + 0.13 * pin, 6.5, 3),
        (wrist, palm, 5.5, 2),
        (palm - 0.04 * R[:, 0], palm + 0.04 * R[:, 0], 4, 2),
        *fingers,
    ]


def floor(axes: Axes) -> None:
    """Draw the floor: lines 0.2 m apart."""
    marks = 0.2 * np.arange(-2, 3)
    for x in marks:
        for ends in ([(x, marks[0], FLOOR), (x, marks[-1], FLOOR)], [(marks[0], x, FLOOR), (marks[-1], x, FLOOR)]):
            points = seen(np.array(ends))
            axes.plot(points[:, 0], points[:, 1], color=GRID, linewidth=0.7, zorder=0)


def draw_configuration(axes: Axes, arm: Arm, branch: Branch) -> None:
    """Draw the arm in one posture; pale where it is outside the limits."""
    dark, light = COLOURS[branch.label.split(",")[0]]
    fills = ("#d3d9df", light, "#52606d", dark)
    strength = 1.0 if branch.allowed else 0.45
    floor(axes)
    parts = bar_chart(arm, branch.q)
    for start, end, width, _ in parts:
        shadow = seen(np.array([start, end]) * (1, 1, 0) + (0, 0, FLOOR))
        axes.plot(shadow[:, 0], shadow[:, 1], color=GRID, linewidth=0.7 * width, solid_capstyle="round", zorder=1)
    # What is nearer hides what is farther away.
    parts.sort(key=lambda part: float(seen((part[0] + part[1]) / 2)[2]))
    for order, (start, end, width, part) in enumerate(parts, 2):
        points = seen(np.array([start, end]))
        pale = mpl.colors.to_rgb(fills[part])
        fill = tuple(1 - strength * (1 - x) for x in pale)
        edge = tuple(1 - strength * (1 - x) for x in mpl.colors.to_rgb(INK))
        for colour, extra in ((edge, 1.4), (fill, 0.0)):
            axes.plot(
                points[:, 0], points[:, 1], color=colour, linewidth=width + extra, solid_capstyle="round", zorder=order
            )
    axes.set(xlim=(-0.33, 0.57), ylim=(-0.59, 0.45), aspect="equal")
    axes.axis("off")


def write_angles(axes: Axes, branch: Branch) -> None:
    """Write the joint angles below the arm, three and three, those outside their limits in red."""
    outside = {violation.joint for violation in branch.violations}
    for i, angle in enumerate(np.degrees(branch.q)):
        red = i + 1 in outside
        axes.text(
            0.5 + 0.26 * (i % 3 - 1),
            -0.02 - 0.09 * (i // 3),
            f"{angle:.0f}°".replace("-", "−"),
            transform=axes.transAxes,
            ha="center",
            va="top",
            fontsize=8.5,
            color=ALARM if red else INK,
            fontweight="bold" if red else "normal",
        )


def configurations() -> Figure:
    """Draw all postures in which the PUMA holds its hand in one pose."""
    arm = load_arm("puma560-seed")
    roll, pitch, yaw = (
        rotation_from_vector(angle * axis) for angle, axis in zip(np.radians(TURN), np.eye(3), strict=True)
    )
    branches = {branch.label: branch for branch in inverse(arm, homogeneous(yaw @ pitch @ roll, PLACE))}
    figure = Figure(figsize=(7.2, 5.45))
    edges = {"left": 0, "right": 1, "top": 0.95, "bottom": 0.085, "hspace": 0.33, "wspace": 0.05}
    rows = figure.subplots(2, 4, gridspec_kw=edges)
    for row, side in zip(rows, COLOURS, strict=True):
        for axes, name in zip(row, CONFIGURATIONS, strict=True):
            branch = branches[f"{side}, {name}"]
            draw_configuration(axes, arm, branch)
            write_angles(axes, branch)
            axes.set_title(branch.label, fontsize=9.5, fontweight="bold", color=COLOURS[side][0], pad=2)
    return figure


# The released arm.

RELEASED = np.radians((0, -60, 60, 0, 30, 0))
DURATION = 6.0  # s
# What the energy becomes: colour, colour of its name, and where its name stands [s], [part of all].
SHARES = {
    "height": ("#1d6fa5", "white", 0.28, 0.35),
    "motion": ("#f0a13c", INK, 1.21, 0.62),
    "taken by the stops": ("#6b7785", "white", 3.6, 0.34),
    "taken by friction": ("#d3d9df", INK, 3.6, 0.82),
}
HELD, MOVING = "#e4e7eb", "#f0a13c"


def impacts(found: Simulation) -> list[Event]:
    """Return the events in which a joint meets a stop."""
    return [event for event in found.events if event.after in (JointState.LOWER_STOP, JointState.UPPER_STOP)]


def draw_energies(axes: Axes, found: Simulation) -> None:
    """Stack what the energy of the start has become."""
    height = found.potential - found.potential.min()
    parts = (height, found.kinetic, found.impact, found.heat.sum(axis=-1))
    axes.stackplot(found.t, *parts, colors=[colour for colour, *_ in SHARES.values()], linewidth=0)
    tops = np.cumsum(parts, axis=0)
    for top in tops[:-1]:
        axes.plot(found.t, top, color="white", linewidth=0.8)
    axes.plot(found.t, tops[-1], color=INK, linewidth=1.4)
    whole = tops[-1, 0]
    for name, (_, ink, t, part) in SHARES.items():
        axes.text(t, part * whole, name, color=ink, ha="center", va="center", fontsize=10.5)
    for event in impacts(found):
        axes.annotate(
            f"joint {event.joint + 1} meets its stop",
            (event.t, whole),
            xytext=(6 if event.t > 1.6 else -6, 8),
            textcoords="offset points",
            ha="left" if event.t > 1.6 else "right",
            fontsize=8.5,
        )
    axes.set(ylabel="energy, J", xlim=(0, DURATION), ylim=(0, 1.1 * whole))
    axes.spines[["top", "right"]].set_visible(False)


def draw_joints(axes: Axes, found: Simulation) -> None:
    """Draw when every joint moves, one strip for each."""
    for joint in range(found.q.shape[1]):
        axes.barh(joint + 1, DURATION, height=0.7, color=HELD, linewidth=0)
        events = [event for event in found.events if event.joint == joint]
        times = [0.0, *(event.t for event in events), DURATION]
        states = [JointState.MOVES, *(event.after for event in events)]
        for start, end, state in zip(times[:-1], times[1:], states, strict=True):
            if state == JointState.MOVES and end > start:
                axes.barh(joint + 1, end - start, left=start, height=0.7, color=MOVING, edgecolor=MOVING, linewidth=0.6)
    axes.text(0.12, 2, "moves", va="center", fontsize=8.5)
    axes.text(0.12, 4, "held by dry friction", va="center", fontsize=8.5)
    axes.set(xlabel="time, s", ylabel="joint", ylim=(6.6, 0.4), yticks=range(1, 7))
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def released() -> Figure:
    """Draw where the energy of a PUMA goes whose drives are switched off."""
    how = Adaptive(rtol=1e-9, atol=1e-11)
    found = simulate(load_arm("puma560-seed"), RELEASED, duration=DURATION, integrator=how, period=0.0125)
    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    energies, joints = figure.subplots(2, 1, sharex=True, height_ratios=(2.3, 1))
    draw_energies(energies, found)
    draw_joints(joints, found)
    for axes in (energies, joints):
        for event in impacts(found):
            axes.axvline(event.t, color=INK, linewidth=0.7, linestyle=(0, (3, 2)))
    return figure


# The two moves.

BY_JOINTS, BY_HAND = "#b45309", "#1d6fa5"
WRIST = {3: "joint 4", 4: "joint 5", 5: "joint 6"}


def draw_ways(axes: Axes) -> None:
    """Draw the paths of the hand of both moves, with approach vectors, over their shadows on a level below."""
    t = puma_moves.sample_times()
    level = -0.75
    stops = puma_moves.study_poses()[:, :3, 3]
    for way, colour, name in (("joint", BY_JOINTS, "joint move"), ("geodesic", BY_HAND, "Cartesian move")):
        X = puma_moves.poses_along(way, t)  # type: ignore[arg-type]
        p = X[:, :3, 3]
        shadow = p.copy()
        shadow[:, 2] = level
        axes.plot(*seen(shadow)[:, :2].T, color=GRID, linewidth=2.2, solid_capstyle="round")
        axes.plot(*seen(p)[:, :2].T, color=colour, linewidth=2.2, label=name)
        some = slice(0, None, 25)
        tips = seen(p[some] + 0.09 * X[some, :3, 2])[:, :2]
        for start, tip in zip(seen(p[some])[:, :2], tips, strict=True):
            axes.plot(*zip(start, tip, strict=True), color=colour, linewidth=0.9)
    for name, stop in zip(puma_moves.NAMES, stops, strict=True):
        foot = stop.copy()
        foot[2] = level
        axes.plot(*zip(seen(foot)[:2], seen(stop)[:2], strict=True), color=FAINT, linewidth=0.6, linestyle=(0, (2, 2)))
        axes.plot(*seen(stop)[:2], "o", color=INK, markersize=5)
        axes.annotate(name, seen(stop)[:2], xytext=(6, 5), textcoords="offset points", fontweight="bold")
    axes.set_aspect("equal")
    axes.axis("off")
    axes.legend(loc="upper left", frameon=False)


def draw_wrist(axes: Axes, joint: int) -> None:
    """Draw the position of one joint of the wrist in both moves, and its limits."""
    t = puma_moves.sample_times()
    limit = np.degrees(load_arm("puma560-seed").joints[joint].limits.upper)
    for way, colour in (("joint", BY_JOINTS), ("geodesic", BY_HAND)):
        axes.plot(t, np.degrees(puma_moves.joints_along(way)(t)[:, joint]), color=colour, linewidth=1.8)  # type: ignore[arg-type]
    for bound in (-limit, limit):
        axes.axhline(bound, color=ALARM, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.set(ylabel=f"{WRIST[joint]}, deg", xlim=(0, 1), ylim=(-290, 290), yticks=(-180, 0, 180))
    axes.grid(color=GRID)
    axes.spines[["top", "right"]].set_visible(False)


def two_moves() -> Figure:
    """Draw a joint move and a Cartesian move through the same three poses, and what the wrist does."""
    figure = Figure(figsize=(7.4, 4.3), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.15, 1))
    draw_ways(left.subplots())
    rows = right.subplots(3, 1, sharex=True)
    for axes, joint in zip(rows, WRIST, strict=True):
        draw_wrist(axes, joint)
    rows[-1].set_xlabel("time, s")
    return figure


# A linkage with play.

MAGNIFIED = 50
JOURNALS = ("J2", "J3", "J4")


# The corner past which both paths go [m]; what is drawn of the way off the leg behind it is so many times enlarged.
CORNER = np.array([(0.45, -0.30, 0.25), (0.45, -0.15, 0.45), (0.45, 0.15, 0.45)])
# To be seen on a white page and on a dark one, without anything behind.
BOTH = "#8a94a0"
PATHS = (("the report's X-spline", "#d9822b", None), ("rounded corners", "#3d8fd1", 0.02))


def past_frames() -> Figure:
    """Draw both paths past a corner: off the leg behind it, and the speed of the hand."""
    arm = load_arm("ur5")
    X = homogeneous(np.diag((1.0, -1.0, -1.0)), CORNER)
    q = inverse(arm, X[0]).best.q
    figure = Figure(figsize=(8.6, 3.4), layout="constrained", facecolor="none")
    off, fast = figure.subplots(1, 2)
    off.axhline(0.0, color=BOTH, linewidth=0.8, linestyle=(0, (4, 3)))
    for label, colour, corner in PATHS:
        goal = StageGoal(kind="SPLINE", poses=X[1:], corner=corner)
        (stage,) = plan(arm, q, [goal], Manner())
        t = np.linspace(0.0, stage.trajectory.duration, 2001)
        hand = forward(arm, stage.trajectory(t))[:, :3, 3]
        behind = hand[:, 1] > CORNER[1, 1] - 0.02
        off.plot(
            hand[behind, 1] * 1e3, (hand[behind, 2] - CORNER[1, 2]) * 1e3, color=colour, linewidth=1.6, label=label
        )
        speed = np.linalg.norm(np.gradient(hand, t, axis=0), axis=-1)
        fast.plot(t, speed * 1e3, color=colour, linewidth=1.6)
        lifted = 5 if corner is None else 22
        fast.annotate(f"{t[-1]:.2f} s", (t[-1], 0), (6, lifted), textcoords="offset points", color=colour)
    off.set(xlabel="y [mm]: the leg from -150 to 150", ylabel="above the straight leg [mm]", ylim=(-16, 12))
    fast.set(xlabel="time [s]", ylabel="speed of the hand [mm/s]", ylim=(0, None), xlim=(0, 1.75))
    off.legend(frameon=False, labelcolor="linecolor", loc="lower right")
    for axes in (off, fast):
        axes.set_facecolor("none")
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(BOTH)
        axes.tick_params(colors=BOTH)
        axes.xaxis.label.set_color(BOTH)
        axes.yaxis.label.set_color(BOTH)
    return figure


def draw_linkage(axes: Axes, run: Rattling) -> None:
    """Draw the five-bar at the start, its path, and the path taken with the error magnified."""
    linkage, q = run.scenario.linkage, run.scenario.ideal.q
    corners = [BodyPoint("ground", "J1"), BodyPoint("link1", "J2"), BodyPoint("link2", "J3")]
    others = [BodyPoint("ground", "J5"), BodyPoint("link4", "J4"), BodyPoint("link3", "J3")]
    for way in (corners, others):
        ends = np.array([point_position(linkage, place, q[0]) for place in way]) * 1e3
        axes.plot(*ends.T, color="#c3cad2", linewidth=7, solid_capstyle="round", zorder=1)
        axes.plot(*ends.T, "o", color="white", markeredgecolor=FAINT, markersize=5, zorder=2)
    path = tip_position(linkage, q)[:: run.scenario.stride] * 1e3
    axes.plot(*path.T, color=INK, linewidth=1.2, linestyle=(0, (4, 3)), label="without play", zorder=3)
    taken = path + MAGNIFIED * run.error * 1e3
    axes.plot(*taken.T, color=BY_HAND, linewidth=1.6, label=f"with play, error × {MAGNIFIED}", zorder=4)
    axes.set_aspect("equal")
    axes.set(xlabel="x, mm", ylabel="y, mm", xlim=(-430, 400))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.16), frameon=False, fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def draw_bearing(axes: Axes, run: Rattling, number: int) -> None:
    """Draw where a journal's middle goes in its bearing: dark while it speeds up and cruises, then red."""
    gap, wall = run.gaps[:, number] * 1e3, run.clearances[number] * 1e3
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(wall * np.cos(angle), wall * np.sin(angle), color=FAINT, linewidth=0.9)
    slows = run.time >= run.scenario.path.knots[-2]
    axes.plot(*gap[slows].T, color=ALARM, linewidth=0.7)
    axes.plot(*gap[~slows].T, color=INK, linewidth=2.4)
    axes.set_aspect("equal")
    axes.set_title(JOURNALS[number], fontsize=9)
    axes.axis("off")


def rattling() -> Figure:
    """Draw the five-bar with half a millimetre of play in three pins on its path y1."""
    run = simulate_play(prepare_scenario(load_linkage("five-bar"), thesis_path("y1")))
    figure = Figure(figsize=(7.4, 4.4), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.1))
    draw_linkage(left.subplots(), run)
    above, below = right.subfigures(2, 1, height_ratios=(1, 1.15))
    for i, axes in enumerate(above.subplots(1, 3)):
        draw_bearing(axes, run, i)
    axes = below.subplots()
    axes.plot(run.time, run.distance * 1e3, color=BY_HAND, linewidth=1.5)
    for knot in run.scenario.path.knots[1:-1]:
        axes.axvline(knot, color=FAINT, linewidth=0.7, linestyle=(0, (2, 2)))
    axes.set(xlabel="time, s", ylabel="error of the tip, mm", xlim=(0, run.time[-1]), ylim=(0, None))
    axes.grid(color=GRID)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


# An arm before and after it is calibrated.


def before_and_after() -> Figure:
    """Draw how far points of the imaginary PUMA are from it as said, calibrated, and with what its joints give."""
    arm = load_arm("puma560-seed")
    measured = read_measurements(HERE.parents[1] / "examples" / "puma_points.csv", arm)
    return distances_figure(assess_calibration(arm, measured, nongeometric=True))


# What a tutorial shows of the studio.

QUALITY = 88


def keep(photo: bytes, picture: Path) -> None:
    """Write a photograph as JPEG, unless the one that is there is the same but for shades."""
    coded = io.BytesIO()
    Image.open(io.BytesIO(photo)).convert("RGB").save(coded, "JPEG", quality=QUALITY, subsampling=0, optimize=True)
    same = runpy.run_path(str(HERE.parent / "make_gallery.py"))["alike"]
    if not (picture.exists() and same(Image.open(coded), Image.open(picture))):
        picture.write_bytes(coded.getvalue())


def photograph_studio() -> None:
    """Do what the tutorial on the studio says, and take its pictures where they stand in the text."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        sys.stderr.write("no chromium on this machine: the pictures of the studio stay as they were\n")
        return
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - not needed for drawings

    text = (HERE.parent / "tutorials" / "studio.md").read_text(encoding="utf-8")
    command, _, told = text.partition("$ armwright ")[2].partition("\n")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--headless", "--no-sandbox"])
        with Session(shlex.split(command), Path(folder), browser) as studio:
            studio.follow(told.partition("```console")[0], lambda name, photo: keep(photo, HERE / name))
        browser.close()


def main() -> None:
    """Draw all pictures, and take those of the studio."""
    with mpl.rc_context(STYLE):
        write(configurations(), "postures.svg")
        write(released(), "released.svg")
        write(two_moves(), "two_moves.svg")
        write(past_frames(), "past_frames.svg")
        write(rattling(), "rattling.svg")
        write(before_and_after(), "calibrated.svg")
    photograph_studio()


if __name__ == "__main__":
    main()
