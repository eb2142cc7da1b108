"""Inputs that the tool of an arm switches by where it is."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.signals import Input
from armwright.cell.simulator import Simulator
from armwright.cell.zones import Zone
from armwright.export import export_program
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.world import PhysicsCell
from armwright.program import Source, run as run_program
from armwright.program.vm.interpreter import interpret
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from program.running import cell_of, code_of, down, printed
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
MOVES = """BEGIN
  MOVE ARM_1 TO ARM_1 * XYZ(0, 0.2, 0) STRAIGHTLY, ON INPUT(gate) DO BEGIN END ;
  PAUSE 0.1 ;
  MOVE ARM_1 TO ARM_1 * XYZ(0.1, -0.3, 0.05) WITH SPEED = 60 ;
  WHEN TIME > 2 DO BEGIN BRAKE ; PAUSE 0.2 ; RESUME END ;
  MOVE ARM_1 TO ARM_1 * XYZ(-0.1, 0.1, -0.1) ;
END."""


def cell_with(**zones: Zone) -> Cell:
    return attrs.evolve(cell_of("cell1"), inputs={name: Input(zone=zone) for name, zone in zones.items()})


def is_inside(zone: Zone, p: Array) -> bool:
    """Whether a point is in a zone, by its distances along the axes of the zone."""
    along = [float(np.dot(zone.pose[:3, axis], p - zone.pose[:3, 3])) for axis in range(3)]
    if zone.sides is None:
        assert zone.radius is not None
        return float(np.hypot(np.hypot(*along[:2]), along[2])) <= zone.radius
    return all(abs(place) <= side / 2 for place, side in zip(along, zone.sides, strict=True))


def test_as_recorded(sample: Sample) -> None:
    """At every tick of a run with guards and stops, an input is what its zone says of the tool that was recorded."""
    rng = np.random.default_rng(sample.seed)
    for _ in range(sample.count(30)):
        p = np.array([0.45, 0.0, 0.25]) + rng.uniform(-0.15, 0.15, 3)
        pose = homogeneous(rotation_from_vector(rng.normal(size=3)), p)
        ball = Zone(arm="ARM_1", pose=pose, radius=rng.uniform(0.02, 0.2))
        box = Zone(arm="ARM_1", pose=pose, sides=rng.uniform(0.05, 0.4, 3), inverted=bool(rng.integers(2)))
        cell = cell_with(GATE=ball, BOX=box)
        hardware = Simulator(cell)
        recording = interpret(code_of(MOVES, cell), cell, hardware)
        stream, arm = recording.streams[0], cell.arms["ARM_1"]
        tools = (arm.base @ forward(arm.arm, stream.q))[:, :3, 3]

        for name, zone in (("GATE", ball), ("BOX", box)):
            expected = [is_inside(zone, p) is not zone.inverted for p in tools]
            assert [hardware.input_at(name, t) == 1.0 for t in stream.t.tolist()] == expected


def test_a_line_through_a_ball() -> None:
    """A guard ends a line at the first tick at which the tool is within the distance of the frame."""
    x, y, z = cell_of("cell1").tree().world("ARM_1")[:3, 3]
    zone = Zone(arm="ARM_1", pose=down(x, y + 0.2, z), radius=0.1)
    cell = cell_with(GATE=zone)
    text = """BEGIN
      MOVE ARM_1 TO ARM_1 * XYZ(0, -0.2, 0) STRAIGHTLY, WITH SPEED = 10, ON INPUT(gate) DO PRINT(DIST(ARM_1, WORLD)) ;
    END."""
    recording = interpret(code_of(text, cell), cell, Simulator(cell))
    at = next(effect.t0 for effect in recording.effects if effect.kind == "PRINT")
    arm, stream = cell.arms["ARM_1"], recording.streams[0]
    tick = round(at / cell.period)
    places = (arm.base @ forward(arm.arm, stream.q[tick - 1 : tick + 1]))[:, 1, 3] - y

    assert places[0] < 0.1 <= places[1] + 1e-9


def test_a_switch_counts_until_the_tool_comes() -> None:
    """An input that is set by hand stays so while the arm moves outside of its zone, and changes when it comes in."""
    x, y, z = cell_of("cell1").tree().world("ARM_1")[:3, 3]
    cell = cell_with(GATE=Zone(arm="ARM_1", pose=down(x, y + 0.2, z), radius=0.05))
    hardware = Simulator(cell)
    hardware.set_input("GATE", 1.0, 0.1)
    text = """BEGIN
      PRINT(INPUT(gate)) ; PAUSE 0.2 ; PRINT(INPUT(gate)) ;
      MOVE ARM_1 TO ARM_1 * XYZ(0, -0.05, 0) STRAIGHTLY ; PRINT(INPUT(gate)) ;
      MOVE ARM_1 TO ARM_1 * XYZ(0, -0.15, 0) STRAIGHTLY ; PRINT(INPUT(gate)) ;
      MOVE ARM_1 TO ARM_1 * XYZ(0, 0.15, 0) STRAIGHTLY ; PRINT(INPUT(gate)) ;
    END."""

    assert printed(interpret(code_of(text, cell), cell, hardware)) == ["false", "true", "true", "true", "false"]


def test_with_physics() -> None:
    """In a cell with physics the arm as it is counts, not as it was sent, and not as its sensors read it."""
    x, y, z = cell_of("cell1").tree().world("ARM_1")[:3, 3]
    zone = Zone(arm="ARM_1", pose=down(x, y + 0.05, z), sides=np.array([1.0, 0.06, 1.0]))
    cell = cell_with(GATE=zone)
    hardware = PhysicsCell(cell)
    text = "BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, -0.05, 0) STRAIGHTLY ; PAUSE 0.05 ; PRINT(INPUT(gate)) END."
    recording = interpret(code_of(text, cell), cell, hardware)
    (measured,), arm = recording.measured, cell.arms["ARM_1"]
    tools = (arm.base @ forward(arm.arm, measured.actual))[:, :3, 3]
    found = [hardware.input_at("GATE", t) == 1.0 for t in measured.t.tolist()]

    assert printed(recording) == ["true"]
    assert found == [is_inside(zone, p) for p in tools]
    assert 0 < sum(found) < len(found)
    assert hardware.copy().input_at("GATE", 0.0) == 0.0


def test_exported() -> None:
    """The proof of an exported program reads such an input as it was at that time of the run."""
    cell = read_cell(EXAMPLES / "ur5_cell.toml")
    x, y, z = cell.tree().world("ARM_1")[:3, 3]
    zone = Zone(arm="ARM_1", pose=down(x, y - 0.1, z), radius=0.02)
    large = attrs.evolve(cell.inputs["LARGE"], timeline=(), zone=zone)
    text = """BEGIN
      IF INPUT(large) THEN PRINT("early") ;
      MOVE ARM_1 TO ARM_1 * XYZ(0, 0.1, 0) STRAIGHTLY ;
      IF INPUT(large) THEN OPERATE lamp ON ;
    END."""
    cell = attrs.evolve(cell, inputs={**cell.inputs, "LARGE": large})
    statements = export_program("urscript", Source("zone.rlo", text), cell).proof.comparisons[0]

    assert (statements.count, statements.worst) == (6, 0.0)
    without = attrs.evolve(cell, inputs={**cell.inputs, "LARGE": attrs.evolve(large, zone=None)})
    assert export_program("urscript", Source("zone.rlo", text), without).proof.comparisons[0].count < statements.count


def test_the_example() -> None:
    """The press of the example begins at the tick at which the arm leaves it, and not before."""
    recording = run_program(EXAMPLES / "press_zone.rlo")
    began = next(effect.t0 for effect in recording.effects if effect.text == "press ON")
    arm, stream = recording.cell.arms["ARM_1"], recording.streams[0]
    tools = (arm.base @ forward(arm.arm, stream.q))[:, :3, 3]
    zone = recording.cell.inputs["FREE"].zone
    assert zone is not None
    inside = [t for t, p in zip(stream.t.tolist(), tools, strict=True) if is_inside(zone, p)]

    assert began == pytest.approx(max(inside) + recording.cell.period)
    assert len(printed(recording)) == 2
