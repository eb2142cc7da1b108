"""Gravity belongs to the world: arms that are turned, tilted or hang feel it as it is there."""

import warnings
from pathlib import Path

import attrs
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.coupling import Coupling
from armwright.arm.gravity import felt_gravity
from armwright.arm.limits import Limits
from armwright.arm.load import load_arm, read_arm
from armwright.arm.model import STANDARD_GRAVITY, UPRIGHT_GRAVITY, Arm, Link
from armwright.arm.urdf.reader import load_urdf
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.cell.frames import WORLD, Node
from armwright.cell.model import Cell, CellArm
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.compiled.quantities import emit_quantity
from armwright.dynamics.energy import potential_energy
from armwright.dynamics.equation_of_motion import terms
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.payloads import payload
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import FileFormatError, GravityWarning, InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.efforts import effort_peaks, lasting_efforts, slowing_for_efforts
from armwright.motion.quintic_polynomials import point_to_point
from armwright.motion.solver import solver_of
from armwright.motion.straight import straight_line
from armwright.program import Source, compile as compile_program, known_cell
from armwright.program.vm.interpreter import interpret, motion_warnings as warnings_of
from armwright.program.vm.recording import Recording
from armwright.report.run_data import run_page_data
from armwright.report.run_summary import RunSummary
from armwright.simulation.simulator import simulate
from armwright.spatial.poses import homogeneous
from armwright.tracing.emit_llvm import Target
from oracles.with_pinocchio import pinocchio_model, with_load, with_rotors
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
ARMS = ("puma560", "stanford", "stanford-jpl", "ur5")
HANGING = homogeneous(np.diag((1.0, -1.0, -1.0)), (0.0, 0.0, 2.0))
# How a base stands: turned on the floor, tilted, on a wall, from the ceiling, any way.
STANDS = ("turned", "tilted", "wall", "hanging", "anyhow")
AGREES = 1e-9  # [N m], of efforts up to some hundred


def base_of(rng: np.random.Generator, stand: str) -> Array:
    """A base that stands so."""
    about_z = Rotation.from_rotvec((0.0, 0.0, rng.uniform(-np.pi, np.pi)))
    lean = {"turned": 0.0, "tilted": rng.uniform(0.01, 0.5), "wall": np.pi / 2, "hanging": np.pi}
    if stand == "anyhow":
        R = Rotation.random(random_state=rng)
    else:
        direction = rng.uniform(-np.pi, np.pi)
        R = Rotation.from_rotvec(lean[stand] * np.array((np.cos(direction), np.sin(direction), 0.0))) * about_z
    return homogeneous(R.as_matrix(), rng.uniform(-2, 2, size=3))


def cell_of(arm: Arm, base: Array, gravity: Array = UPRIGHT_GRAVITY) -> Cell:
    """A cell of one arm, which stands at zero."""
    start = np.clip(np.zeros(arm.n), arm.limits.lower, arm.limits.upper)
    return Cell(name="cell", arms={"ARM_1": CellArm(arm=arm, base=base, start=start)}, gravity=gravity)


def of_world(arm: Arm, base: Array, gravity: Array) -> tuple[pin.Model, pin.Data, int]:
    """The arm in Pinocchio, standing on its base in a world with that gravity: rotors included."""
    model, _, tool = pinocchio_model(attrs.evolve(arm, base=base @ arm.base, gravity=gravity))
    return *with_rotors(model, arm), tool


def test_efforts_of_every_stand(sample: Sample) -> None:
    """Pinocchio, told where the base stands in the world, finds the efforts of every arm, turned, tilted or hanging."""
    worst = 0.0
    for rng in sample.cases(100):
        arm, stand = load_arm(str(rng.choice(ARMS))), str(rng.choice(STANDS))
        base = base_of(rng, stand)
        gravity = UPRIGHT_GRAVITY if rng.random() < 0.7 else rng.normal(scale=8.0, size=3)
        model, data, tool = of_world(arm, base, gravity)
        mine = cell_of(arm, base, gravity).arms["ARM_1"].arm
        load = Link(mass=rng.uniform(0.1, 3.0), com=rng.normal(scale=0.1, size=3), inertia=np.diag([0.02, 0.02, 0.01]))
        laden, laden_data = with_load(model, tool, load)
        for _ in range(5):
            q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))
            carried = payload(mine, load.mass, load.com, load.inertia)
            for theirs, room, ours in ((model, data, mine), (laden, laden_data, carried)):
                expected = pin.rnea(theirs, room, q, qd, qdd)
                dry = inverse_dynamics(ours, q, qd, 0 * q) - inverse_dynamics(ours, q, qd, 0 * q, drives=False)
                worst = max(worst, float(np.abs(inverse_dynamics(ours, q, qd, qdd) - dry - expected).max()))
    assert worst < AGREES
    sample.record("efforts of arms on bases turned, tilted and hanging", sample.count(100), 0, worst=f"{worst:.1e} N m")


@pytest.mark.parametrize("stand", ["hanging", "wall", "tilted"])
@pytest.mark.drawn(0.34)
def test_one_gravity_for_all(rng: np.random.Generator, stand: str) -> None:
    """Holding efforts, terms, payload, slowing, energy and simulation weigh an arm in a cell all alike."""
    arm = load_arm("puma560")
    base = {
        "hanging": HANGING,
        "wall": homogeneous(Rotation.from_euler("x", 90, degrees=True).as_matrix(), np.zeros(3)),
    }.get(stand, base_of(np.random.default_rng(3), "tilted"))
    mine = cell_of(arm, base).arms["ARM_1"].arm
    q = rng.uniform(-1.5, 1.5, size=6)
    still = np.zeros(6)
    model, data, _ = of_world(arm, base, UPRIGHT_GRAVITY)
    weight = np.array(pin.computeGeneralizedGravity(model, data, q))
    load = Link(mass=2.0)
    laden = payload(mine, load.mass)

    np.testing.assert_allclose(inverse_dynamics(mine, q, still, still), weight, atol=AGREES)
    np.testing.assert_allclose(gravity_efforts(mine, q), weight, atol=AGREES)
    np.testing.assert_allclose(terms(mine, q, still, still).total, weight, atol=AGREES)
    np.testing.assert_allclose(lasting_efforts(solver_of(mine), q, still), weight, atol=AGREES)
    np.testing.assert_allclose(
        gravity_efforts(laden, q), gravity_efforts(mine, q) + terms(mine, q, still, still, load=load).load, atol=AGREES
    )
    slope = [(potential_energy(mine, q + h) - potential_energy(mine, q - h)) / 2e-6 for h in np.eye(6) * 1e-6]
    np.testing.assert_allclose(slope, weight, atol=1e-6)
    run = simulate(mine, q, controller=lambda _t, q, _qd: gravity_efforts(mine, q), duration=0.05)
    np.testing.assert_allclose(run.q[-1], q, atol=1e-9)  # held by what weighs it, it does not fall
    np.testing.assert_allclose(run.tau[0], weight, atol=AGREES)


def moved(cell: Cell, text: str) -> Recording:
    """Run a program in a cell."""
    compiled = compile_program(Source("t.rlo", text), known_cell(cell))
    assert compiled.code is not None, compiled.diagnostics
    return interpret(compiled.code, cell, Simulator(cell))


def test_a_program_on_the_ceiling(rng: np.random.Generator) -> None:
    """The efforts of every tick, the peaks and the warning are those of a PUMA that hangs, as Pinocchio has them."""
    weak = load_arm("puma560")
    joints = [attrs.evolve(weak.joints[1], limits=attrs.evolve(weak.joints[1].limits, effort=30.0))]
    weak = attrs.evolve(weak, joints=(weak.joints[0], *joints, *weak.joints[2:]))
    start = np.array((0.0, 0.3, 0.2, 0.0, 0.4, 0.0))
    goal = forward(weak, start + np.array((0.6, -0.3, 0.2, 0.1, 0.2, 0.3)))
    cell = Cell(
        name="ceiling",
        arms={"ARM_1": CellArm(arm=weak, base=HANGING, start=start)},
        frames={"GOAL": Node(parent=WORLD, relation=HANGING @ goal)},
    )

    recording = moved(cell, "VAR GOAL : FRAME ; BEGIN MOVE ARM_1 TO GOAL ; END.")

    (stream,) = recording.streams
    model, data, _ = of_world(weak, HANGING, UPRIGHT_GRAVITY)
    dry = [motor.coulomb_forward for motor in weak.motors]
    ticks = rng.integers(0, len(stream.t), size=50)
    expected = [pin.rnea(model, data, stream.q[k], stream.qd[k], stream.qdd[k]) for k in ticks]
    np.testing.assert_allclose(stream.tau[ticks] - np.sign(stream.qd[ticks]) * dry, expected, atol=AGREES)
    (stage,) = recording.stages
    np.testing.assert_allclose(stage.peak_effort, np.abs(stream.tau).max(axis=0), atol=AGREES)
    found = warnings_of(recording.stages, recording.cell)
    assert [one.code for one in found] == ["W401"]
    assert f"joint 2 of ARM_1 would need {stage.peak_effort[1]:.1f} N m" in found[0].message


def test_drives_that_are_asked_for_too_much() -> None:
    """Where drives are coupled, the warning is about the drive whose own limit is passed."""
    C = np.eye(6)
    C[2, 1] = -1.0
    weak = [Limits(), Limits(), Limits(effort=4.0), Limits(), Limits(), Limits()]
    arm = attrs.evolve(load_arm("puma560"), coupling=Coupling(matrix=C, limits=weak))
    start = np.array((0.0, 0.3, 0.2, 0.0, 0.4, 0.0))
    cell = Cell(
        name="belt",
        arms={"ARM_1": CellArm(arm=arm, base=np.eye(4), start=start)},
        frames={"GOAL": Node(parent=WORLD, relation=forward(arm, start + 0.3))},
    )

    recording = moved(cell, "VAR GOAL : FRAME ; BEGIN MOVE ARM_1 TO GOAL ; END.")

    (stage,), (stream,) = recording.stages, recording.streams
    efforts = np.abs(stream.tau @ C).max(axis=0)
    np.testing.assert_allclose(stage.peak_effort, [*np.abs(stream.tau).max(axis=0), *efforts], atol=AGREES)
    assert stage.effort_shares(arm)[2] == pytest.approx(max(efforts[2] / 4, stage.peak_effort[2] / 89.4))
    (found,) = warnings_of(recording.stages, recording.cell)
    assert found.message.startswith(f"the drive of joint 3 of ARM_1 would need {efforts[2]:.1f} N m")


def test_efforts_without_masses() -> None:
    """Of an arm without masses no efforts are told: not in the data of a run, not in its tables, not on its page."""
    arm = load_arm("kr6-r900")
    start = np.array((0.0, -1.2, 1.4, 0.0, 0.5, 0.0))
    cell = Cell(
        name="light",
        arms={"ARM_1": CellArm(arm=arm, base=np.eye(4), start=start)},
        frames={"GOAL": Node(parent=WORLD, relation=forward(arm, start + 0.2))},
    )
    recording = moved(cell, "VAR GOAL : FRAME ; BEGIN MOVE ARM_1 TO GOAL ; END.")
    summary = RunSummary(recording=recording, diagnostics=(), hint="")

    (row,) = summary.as_data()["stages"]
    assert row["peak_effort"] is None
    assert row["effort_of_limit"] is None
    assert "the masses of kr6-r900 (ARM_1) are unknown, and so are its efforts" in summary.notes
    *_, table = summary.tables()
    assert table.rows[0][-1] == "unknown"
    page = run_page_data(recording, command="", diagnostics=())
    assert page.arms[0].tau is None
    assert page.stages[0].effort_share is None


def test_motions_on_the_ceiling() -> None:
    """Slowing for efforts, their peaks and the certificate of a line weigh a hanging arm as it hangs."""
    arm = load_arm("puma560")
    mine = cell_of(arm, HANGING).arms["ARM_1"].arm
    upside = attrs.evolve(arm, gravity=(0.0, 0.0, STANDARD_GRAVITY))
    a, b = np.radians([10, -30, 40, 20, 50, 10]), np.radians([30, -40, 50, 10, 50, 10])

    move = point_to_point(arm, a, b)
    assert effort_peaks(mine, move).peaks.tolist() == effort_peaks(upside, move).peaks.tolist()
    assert not np.allclose(effort_peaks(mine, move).peaks, effort_peaks(arm, move).peaks, atol=1.0)
    need = effort_peaks(mine, move.slowed(100.0)).peaks * 1.05
    limited = [
        attrs.evolve(joint, limits=attrs.evolve(joint.limits, effort=float(most)))
        for joint, most in zip(mine.joints, need, strict=True)
    ]
    tight = attrs.evolve(mine, joints=limited)
    slower = slowing_for_efforts(tight, move)
    assert slower.factor > 1
    peaks = effort_peaks(attrs.evolve(upside, joints=limited), move.slowed(slower.factor)).peaks
    assert (peaks <= need * (1 + 1e-6)).all()
    line = straight_line(mine, a, forward(mine, b))
    found = line.certificate.peaks["effort"]
    hanging, standing = (effort_peaks(one, line.trajectory).peaks for one in (upside, arm))
    # The certificate looks at the efforts between its knots, not at their very peaks.
    np.testing.assert_allclose(found, hanging, rtol=0.05)
    assert not np.allclose(found, standing, rtol=0.05)


def test_right_angles_are_exact() -> None:
    """A base at a right angle to gravity feels it along one axis to the last bit, whatever the rounding of the base."""
    for turn in (0, 90, 180, 270):
        R = Rotation.from_euler("zx", (17, turn), degrees=True).as_matrix()
        felt = felt_gravity(
            homogeneous(R @ Rotation.from_euler("z", 40, degrees=True).as_matrix(), np.zeros(3)), UPRIGHT_GRAVITY
        )
        assert abs(felt).max() <= STANDARD_GRAVITY + 1e-12
        if turn in {0, 180}:
            assert felt.tolist() == [0.0, 0.0, -STANDARD_GRAVITY if turn == 0 else STANDARD_GRAVITY]
    assert felt_gravity(np.eye(4), UPRIGHT_GRAVITY).tolist() == UPRIGHT_GRAVITY.tolist()
    assert felt_gravity(HANGING, np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


def test_kernels_by_direction() -> None:
    """Turned about the vertical an arm keeps its kernels; hung up, only those that weigh it are others."""
    arm = load_arm("puma560")
    turned = homogeneous(Rotation.from_euler("z", 33, degrees=True).as_matrix(), (1.0, 0.0, 0.0))
    stands, turns, hangs = (cell_of(arm, base).arms["ARM_1"].arm for base in (np.eye(4), turned, HANGING))
    target = Target(lanes=8, has_fma=True)
    weigh = {"inverse_dynamics", "inverse_dynamics_with_wrench", "forward_dynamics", "mass_and_bias"}
    for name in ("forward", "jacobian", "mass_matrix", *sorted(weigh)):
        sources = [emit_quantity(arm, name).single_ir(target) for arm in (arm, stands, turns, hangs)]
        assert sources[0] == sources[1] == sources[2]
        assert (sources[0] != sources[3]) == (name in weigh)


# ---- what files say ------------------------------------------------------------------------------------------------

CELL = """gravity_m_per_s2 = [0, 0, -1.62]
[arms.ARM_1]
model   = "mine.toml"
base    = [1, 0, 0,  0, -1, 0,  0, 0, -1,  0, 0, 2]
joint_positions = [0, 0.5, 0.4, 0, 0.6, 0]
"""


def written(tmp_path: Path, arm: Arm, cell: str = CELL) -> Path:
    """A cell file beside the file of its arm."""
    (tmp_path / "mine.toml").write_text(toml_text(arm), encoding="utf-8")
    (tmp_path / "cell.toml").write_text(cell, encoding="utf-8")
    return tmp_path / "cell.toml"


def test_the_key(tmp_path: Path) -> None:
    """On the moon an arm that hangs feels the moon's gravity along its own z axis, and nobody is warned."""
    cell = read_cell(written(tmp_path, load_arm("puma560")))

    assert cell.gravity.tolist() == [0.0, 0.0, -1.62]
    assert cell.arms["ARM_1"].arm.gravity.tolist() == [0.0, 0.0, 1.62]
    assert cell.arms["ARM_1"].arm.gravity_from == "world"


def test_own_gravity_in_a_cell(tmp_path: Path) -> None:
    """An arm file's own gravity counts outside of cells; inside it is ignored, and both vectors are named."""
    own = attrs.evolve(load_arm("puma560"), gravity=(0.0, 9.8, 0.5))
    path = written(tmp_path, own)
    assert read_arm(tmp_path / "mine.toml").gravity.tolist() == [0.0, 9.8, 0.5]

    with pytest.warns(GravityWarning) as caught:
        cell = read_cell(path)

    assert len(caught) == 1
    assert str(caught[0].message) == (
        "cell 'cell.toml', ARM_1: 'puma560' has the gravity (0, 9.8, 0.5) m/s² of its file, which counts outside of "
        "cells only; here its base feels (0, 0, 1.62) m/s², from (0, 0, -1.62) m/s² of the cell"
    )
    assert cell.arms["ARM_1"].arm.gravity.tolist() == [0.0, 0.0, 1.62]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        attrs.evolve(cell, name="again")  # it has the cell's by now


def test_stated_as_usual(tmp_path: Path) -> None:
    """A file that states the usual gravity states it, too: on the ceiling it is ignored with a warning."""
    path = written(tmp_path, load_arm("puma560"), CELL.replace("-1.62", "-9.80665"))
    (tmp_path / "mine.toml").write_text(
        "gravity.m_per_s2 = [0, 0, -9.80665]\n" + (tmp_path / "mine.toml").read_text(encoding="utf-8")
    )

    with pytest.warns(GravityWarning, match=r"gravity \(0, 0, -9.80665\) m/s² of its file.* feels \(0, 0, 9.80665\)"):
        read_cell(path)
    assert "gravity" in toml_text(read_arm(tmp_path / "mine.toml"))


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("9.8", "gravity_m_per_s2: expected a list of 3 numbers"),
        ("[0, 0]", "gravity_m_per_s2: expected"),
        ("[0, 0, -9806.65]", "expected no more than 1000 m/s² in all; that of the earth is [0, 0, -9.80665]"),
    ],
)
def test_mistakes(tmp_path: Path, value: str, said: str) -> None:
    """Gravity that is no vector, or in other units, is refused with its line and key."""
    path = written(tmp_path, load_arm("puma560"), CELL.replace("[0, 0, -1.62]", value))
    with pytest.raises(FileFormatError) as caught:
        read_cell(path)
    assert said in str(caught.value)
    assert "cell.toml:1: gravity_m_per_s2" in str(caught.value)


def test_urdf_says_which() -> None:
    """In a URDF file gravity points down in the root link; in a cell that does not count, and both are named."""
    arm = load_urdf(EXAMPLES / "seven_joints.urdf")
    assert arm.gravity_from == "root"
    with pytest.warns(GravityWarning, match="of the root link of its URDF file, which counts outside of cells only"):
        cell_of(arm, HANGING)


def test_who_says_so() -> None:
    """Another gravity than the usual is stated by whoever built the arm; a word that says nothing is refused."""
    arm = attrs.evolve(load_arm("puma560"), gravity=(0.0, 0.0, -1.62))
    assert arm.gravity_from == "stated"
    assert load_arm("puma560").gravity_from == "standard"
    with pytest.raises(InvalidValueError, match="expected gravity_from to be one of standard, stated, root, world"):
        attrs.evolve(arm, gravity_from="moon")
