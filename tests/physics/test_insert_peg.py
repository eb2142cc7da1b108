"""The example of a peg in a socket: how it jams, how it gets in, and where what has a spread stands in a world."""

from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import armwright.program
from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.scene import Spread
from armwright.physics.draws import drawn_frames, placed_fixtures
from armwright.physics.trials import draw_case, judge
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous
from samples import Sample

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAM, CELL = EXAMPLES / "insert_peg.rlo", EXAMPLES / "socket_cell.toml"
# The peg's origin is half its length above the floor of the hole.
HALF = 0.04


@pytest.fixture(scope="module")
def cell() -> Cell:
    return read_cell(CELL)


def off(cell: Cell, position: tuple[float, float, float], rotation: tuple[float, float, float]) -> PhysicsCell:
    """A world whose socket is off by a position [mm] and a rotation [deg], and whose peg is where the file has it."""
    X = homogeneous(Rotation.from_rotvec(rotation, degrees=True).as_matrix(), np.array(position) * 1e-3)
    believed = cell.tree().world("SOCKET")
    turned = homogeneous(X[:3, :3] @ believed[:3, :3], believed[:3, 3] + X[:3, 3])
    return PhysicsCell(cell, parts=cell.parts, frames=drawn_frames(cell, np.random.default_rng(0)) | {"SOCKET": turned})


def short(world: PhysicsCell) -> float:
    """How far the end of the peg is from the floor of the hole, along its axis [m]."""
    X, peg = world.true_frame("SOCKET"), world.true_pose("PEG")
    return float(X[:3, 2] @ (peg[:3, 3] - HALF * peg[:3, 2] - X[:3, 3]))


def without_recovery(cell: Cell) -> armwright.program.Compilation:
    """The example without what it does once it has jammed."""
    text = PROGRAM.read_text(encoding="utf-8")
    assert text.count("tries < 3") == 1
    return armwright.program.compile(armwright.program.Source("once.rlo", text.replace("tries < 3", "tries < 1")), cell)


@pytest.mark.parametrize(
    ("position", "rotation"),
    [
        ((2, 0, 0), (0, 0, 0)),
        ((0, -2, 0), (0, 0, 0)),
        ((0, 0, 0), (0, 0, 3)),
        ((0, 0, 0), (3, 0, 0)),
        ((0, 0, 0), (0, -3, 0)),
    ],
)
def test_straight_insertion_jams(
    cell: Cell, position: tuple[float, float, float], rotation: tuple[float, float, float]
) -> None:
    """2 mm or 3 degrees off, the peg does not get in; the guard on force stops it before anything is a mishap."""
    world = off(cell, position, rotation)

    recording = armwright.program.run(without_recovery(cell), hardware=world)

    assert [effect.text for effect in recording.effects if effect.kind == "PRINT"] == ['PRINT "given up"']
    assert short(world) > 5e-3
    assert world.mishaps == ()


def test_straight_insertion_where_the_socket_is_as_believed(cell: Cell) -> None:
    """Nothing else stands in the way: where the file has the socket the peg gets in at once."""
    world = off(cell, (0, 0, 0), (0, 0, 0))

    recording = armwright.program.run(without_recovery(cell), hardware=world)

    assert [effect.text for effect in recording.effects if effect.kind == "PRINT"] == ['PRINT "seated"']
    assert abs(short(world)) < 2e-4


@pytest.mark.share(0.01)
@pytest.mark.proof
def test_recovery(sample: Sample, cell: Cell) -> None:
    """Wherever the socket is within its spread, the peg ends up in it, let go, as the world judges it."""
    program, causes, distances = armwright.program.compile(PROGRAM, cell), [], []
    for rng in sample.cases(100):
        case = draw_case(cell, int(rng.integers(2**31)), 1)
        world = case.world()
        recording = armwright.program.run(program, hardware=world)
        verdict = judge(world, case.cell, recording.duration)
        causes.append(verdict.cause)
        distances.append(verdict.distance)
    failures = [cause for cause in causes if cause]
    sample.record("pegs in sockets", len(causes), len(failures), worst=max(distances))
    assert len(failures) <= 0.05 * len(causes), failures


def test_drawn_frames_fill_their_spread(cell: Cell) -> None:
    """Positions, rotations about z and tilts are within the bounds and near them; what is on a frame moves with it."""
    believed, rng = cell.tree().world("SOCKET"), np.random.default_rng(4)
    drawn = np.array([drawn_frames(cell, rng)["SOCKET"] for _ in range(400)])
    offsets = drawn[:, :2, 3] - believed[:2, 3]
    tilts = np.degrees(np.arccos(np.clip(drawn[:, 2, 2], -1, 1)))
    # Free of the tilt, which is about a horizontal axis, the rotation is about z.
    yaws = np.degrees([Rotation.from_matrix(X[:3, :3]).as_rotvec()[2] for X in drawn])

    assert 1.95e-3 < np.abs(offsets).max() <= 2e-3
    assert 2.9 < tilts.max() <= 3
    assert 2.9 < np.abs(yaws).max() <= 3.01
    assert (drawn[:, 2, 3] == believed[2, 3]).all()


def test_what_stands_on_a_frame_moves_with_it(cell: Cell) -> None:
    """In a world each box of the socket has the pose on the true frame that the file gives it; the table stays."""
    frames = drawn_frames(cell, np.random.default_rng(2))
    moved = frames["SOCKET"] @ np.linalg.inv(cell.tree().world("SOCKET"))
    placed = placed_fixtures(cell, frames)
    for name, fixture in cell.fixtures.items():
        expected = moved @ fixture.pose if fixture.on == "SOCKET" else fixture.pose
        np.testing.assert_allclose(placed[name].pose, expected, atol=1e-12)
    assert np.linalg.norm(moved - np.eye(4)) > 1e-4


def test_frames_on_a_frame_that_is_drawn(cell: Cell) -> None:
    """They keep their place on it, and add a spread of their own."""
    nested = attrs.evolve(
        cell, frames=cell.frames | {"RIM": attrs.evolve(cell.frames["SOCKET"], parent="SOCKET")}, spreads=cell.spreads
    )
    frames = drawn_frames(nested, np.random.default_rng(1))
    relation = cell.frames["SOCKET"].relation
    np.testing.assert_allclose(frames["RIM"], frames["SOCKET"] @ relation, atol=1e-15)

    own = attrs.evolve(nested, spreads={"RIM": Spread(position=1e-3)})
    frames = drawn_frames(own, np.random.default_rng(1))
    np.testing.assert_array_equal(frames["SOCKET"], relation)
    assert 0 < np.abs(frames["RIM"] - relation @ relation).max() <= 1e-3


def _sunk(cell: Cell, contact_time: float) -> float:
    """How deep a block has sunk into a table that is so hard [m]."""
    peg: Array = cell.parts["PEG"].pose
    fixtures = {"TABLE": attrs.evolve(cell.fixtures["TABLE"], contact_time=contact_time)}
    world = PhysicsCell(attrs.evolve(cell, fixtures=fixtures), parts=cell.parts)
    assert world.advance(0.5) is None
    return float(peg[2, 3] - world.true_pose("PEG")[2, 3])


def test_hardness(cell: Cell) -> None:
    """A contact is a spring whose stiffness goes with the square of the inverse of its time constant."""
    soft, hard = _sunk(cell, 0.02), _sunk(cell, 0.005)
    assert soft / hard == pytest.approx(16, rel=0.2)
