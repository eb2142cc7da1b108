"""Frames of assemblies: their names, their places, and programs that IMPORT them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from armwright.cell.assembly import LONGEST_NAME, assembly_cell, frames_text, read_assembly_frames
from armwright.cell.frames import FrameTree
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError
from armwright.files.limits import raised
from armwright.program.api import compile as translate, import_reader, read_imported_cell
from armwright.program.language.words import VOCABULARIES, Standard
from cli_calls import armwright

STEP = Path(__file__).parents[1] / "spatial" / "step_files" / "fixture.step"
RESERVED = VOCABULARIES[Standard.RLO_2].reserved


def assembly(path: Path, nodes: list[dict[str, Any]]) -> Path:
    below = {child for node in nodes for child in node.get("children", ())}
    tops = [number for number in range(len(nodes)) if number not in below]
    path.write_text(
        json.dumps({"asset": {"version": "2.0"}, "scenes": [{"nodes": tops}], "nodes": nodes}), encoding="utf-8"
    )
    return path


def scene(names: list[str], **keys: Any) -> list[dict[str, Any]]:
    """Return components of one assembly."""
    return [{"name": "Cell", "children": list(range(1, len(names) + 1))}, *({"name": name, **keys} for name in names)]


def test_names(tmp_path: Path) -> None:
    """Names are valid in a program: upper case, letters A to Z, none reserved, none twice, none too long."""
    long = "a very long name of a component in some large assembly"
    names = ["Nest", "nest", "Träger 2", "2nd", "WORLD", "arm-1", "Step", "()", "NEST_2", long, long, "Nest "]
    read = read_assembly_frames(assembly(tmp_path / "a.gltf", scene(names)), RESERVED)

    cut = "A_VERY_LONG_NAME_OF_A_COMPONENT"
    expected = ["CELL", "NEST", "NEST_2", "TRAGER_2", "N_2ND", "WORLD_FRAME", "ARM_1_FRAME", "STEP_FRAME", "PART"]
    expected += ["NEST_2_2", cut, f"{cut[:-2]}_2", "NEST_3"]
    assert list(read.frames) == expected
    assert all(len(name) <= LONGEST_NAME for name in read.frames)
    assert VOCABULARIES[Standard.RLO_2].longest_name == LONGEST_NAME
    assert read.renamed["STEP_FRAME"] == "Step"
    assert read.renamed["N_2ND"] == "2nd"
    assert not {"CELL", "NEST"} & set(read.renamed)


def test_places(tmp_path: Path, rng: np.random.Generator) -> None:
    """A frame is where trimesh puts its component; nodes without a name, and scales, move what is in them."""
    matrices = trimesh.transformations
    turns = [matrices.random_rotation_matrix(rng.uniform(size=3), translate=False) for _ in range(4)]
    poses = [matrices.translation_matrix(rng.uniform(-1, 1, 3)) @ turn for turn in turns]
    keys = [{"matrix": X.T.ravel().tolist()} for X in poses]
    scaled = np.diag((2.0, 2.0, 2.0, 1.0)) @ poses[1]
    nodes = [
        {"name": "top", "children": [1], **keys[0]},
        {"children": [2], "matrix": scaled.T.ravel().tolist()},
        {"name": "sub", "children": [3], **keys[2]},
        {"name": "pin", **keys[3]},
    ]
    path = assembly(tmp_path / "a.gltf", nodes)

    cell = assembly_cell(path)

    assert {name: node.parent for name, node in cell.frames.items()} == {"TOP": "WORLD", "SUB": "TOP", "SUB_PIN": "SUB"}
    graph = trimesh.load_scene(path).graph
    tree = FrameTree(cell.frames)
    for frame, node in (("TOP", "top"), ("SUB", "sub"), ("SUB_PIN", "pin")):
        X = graph[node][0]
        np.testing.assert_allclose(tree.world(frame)[:3, 3], X[:3, 3], atol=1e-6)
        np.testing.assert_allclose(tree.world(frame)[:3, :3], X[:3, :3] / np.cbrt(np.linalg.det(X[:3, :3])), atol=1e-6)


def test_several_tops(tmp_path: Path) -> None:
    """Where a file has several assemblies, the names of all are in front of those of their components."""
    nodes = [{"name": "a", "children": [1]}, {"name": "x"}, {"name": "b", "children": [3]}, {"name": "x"}]
    assert list(read_assembly_frames(assembly(tmp_path / "a.gltf", nodes)).frames) == ["A", "A_X", "B", "B_X"]
    assert list(read_assembly_frames(assembly(tmp_path / "b.gltf", [{"name": "a"}])).frames) == ["A"]


@pytest.mark.parametrize(
    ("nodes", "said"),
    [
        ([{}], "expected components with names, got none"),
        ([{"name": "x", "scale": [1, -1, 1]}], "the component 'x' is mirrored or sheared, as no frame can be"),
        ([{"name": "x", "scale": [0, 1, 1]}], "mirrored or sheared"),
        (
            [{"name": "x", "translation": [2000, 0, 0]}],
            "the component 'x' is farther than 1000 m away; expected metres",
        ),
        ([{"name": 3}], "nodes 1, name: expected a text in quotes, got 3"),
        ([{"name": "x"}] * 5, "too many named components: the limit is 4 frames"),
    ],
)
def test_mistakes(nodes: list[dict[str, Any]], said: str, tmp_path: Path) -> None:
    """Components that no frame can be are refused with their names."""
    with raised(frames=4), pytest.raises(FileFormatError) as error:
        read_assembly_frames(assembly(tmp_path / "a.gltf", nodes))
    assert said in str(error.value)


def test_a_cell_is_no_assembly(tmp_path: Path) -> None:
    """An assembly in place of a cell file is refused."""
    with pytest.raises(FileFormatError, match="expected a cell file; an assembly is for IMPORT"):
        read_cell(assembly(tmp_path / "a.gltf", scene(["x"])))


def test_import(tmp_path: Path) -> None:
    """A program has the frames of an assembly that it IMPORTs, as it has those of the file that convert writes."""
    path = assembly(tmp_path / "nest.gltf", scene(["Pin 1", "Pin 2"], translation=[0.5, 0.1, 0.3]))
    done = armwright("convert", path, "-o", tmp_path / "nest.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        f"nest.gltf: 3 frames written to {tmp_path / 'nest.toml'}",
        "  PIN_1 is the component 'Pin 1'",
        "  PIN_2 is the component 'Pin 2'",
    ]
    for name in ("nest.gltf", "nest.toml"):
        (tmp_path / "p.rlo").write_text(f'IMPORT "{name}";\nBEGIN\n  MOVE ARM-1 TO Pin_2;\nEND.\n', encoding="utf-8")
        cell = read_cell(Path(__file__).parents[2] / "examples" / "stanford_cell.toml")
        compiled = translate(tmp_path / "p.rlo", cell)
        assert not compiled.diagnostics
        brought = import_reader(tmp_path)(name)
        assert brought.frames == {"CELL": "WORLD", "PIN_1": "CELL", "PIN_2": "CELL"}
        assert brought.cell is not None
        np.testing.assert_array_equal(brought.cell.frames["PIN_2"].relation[:3, 3], (0.5, 0.1, 0.3))


def test_convert_step(tmp_path: Path) -> None:
    """The frames that convert writes are those of the assembly, the names of nested components in front."""
    pytest.importorskip("cascadio")
    done = armwright("convert", STEP, "-o", tmp_path / "frames.toml", "--json")
    direct = read_assembly_frames(STEP, RESERVED)

    data = json.loads(done.stdout)
    assert data["frames"] == [
        "FIXTURE", "BASE_PLATE", "NEST", "NEST_PIN", "NEST_PIN_2",
        "N_2ND_NEST_REAR", "N_2ND_NEST_REAR_PIN", "N_2ND_NEST_REAR_PIN_2",
    ]  # fmt: skip
    assert data["renamed"]["NEST_PIN_2"] == "Nest/Pin"
    again = read_imported_cell(tmp_path / "frames.toml").frames
    assert {name: node.parent for name, node in again.items()} == {n: node.parent for n, node in direct.frames.items()}
    for name, node in again.items():
        np.testing.assert_allclose(node.relation, direct.frames[name].relation, atol=1e-9)
    np.testing.assert_array_equal(FrameTree(again).world("NEST_PIN_2")[:3, 3].round(9), (0.2, 0.13, 0.05))
    assert '# "2nd nest, rear"' in frames_text(direct, "x\n")
    wrong = armwright("convert", STEP, "-o", tmp_path / "frames.urdf")
    assert wrong.returncode == 2
