"""What follows from the same is found again: by the sources, the arm and the processor, and never by less."""

import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import attrs
import numpy as np
import pytest

import armwright
from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.errors import ArmwrightError
from armwright.tracing import native, surroundings
from armwright.tracing.emit import emit
from armwright.tracing.image import CAN_BE_LINKED, linked, placed
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import sin

ROOT = Path(armwright.__file__).parent
_FORWARD = """
import sys
import numpy as np
from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from armwright.tracing import emit
traced, trace = [], emit._traced
emit._traced = lambda *given: traced.append(0) or trace(*given)
X = compile_arm(load_arm("puma560")).forward(np.full((3, 6), 0.5))
print(X.tobytes().hex(), len(traced), int("llvmlite" in sys.modules))
"""


_LINE = """
import sys
import numpy as np
from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.straight import straight_line
from armwright.tracing.emit_loops import EmittedLoops
written, module = [], EmittedLoops.module
EmittedLoops.module = lambda *given: written.append(0) or module(*given)
arm = load_arm("puma560")
q = np.array([0.6, -0.3, 0.9, 0.3, 0.9, 0.1])
X = forward(arm, q)
X[:3, 3] += 0.1, -0.4, -0.28
motion = straight_line(compile_arm(arm), q, X, deviation=1e-4)
print(motion.trajectory.coefficients.tobytes().hex()[:1000], len(written), int("llvmlite" in sys.modules))
"""


def _run(sources: Path, cache: Path, program: str = _FORWARD) -> list[str]:
    environment = os.environ | {"PYTHONPATH": str(sources), "ARMWRIGHT_CACHE": str(cache)}
    command = [sys.executable, "-B", "-c", program]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_later_processes_need_no_compiler_until_a_source_changes(tmp_path: Path) -> None:
    """The second process neither traces nor loads LLVM, and has the same bits; after a change of a source it traces."""
    sources = shutil.copytree(ROOT, tmp_path / "src" / "armwright", ignore=shutil.ignore_patterns("__pycache__")).parent
    first, second = (_run(sources, tmp_path / "cache") for _ in range(2))
    with (sources / "armwright" / "kinematics" / "forward_kinematics.py").open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    third = _run(sources, tmp_path / "cache")

    assert first[1:] == ["1", "1"]
    assert second[1:] == ["0", "0"]
    assert third[1] == "1"
    assert first[0] == second[0] == third[0]


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_later_processes_plan_a_line_without_a_compiler(tmp_path: Path) -> None:
    """The routines of a planner are found again as well: the second process neither writes them nor loads LLVM."""
    first, second = (_run(ROOT.parent, tmp_path, _LINE) for _ in range(2))

    assert int(first[1]) > 0
    assert first[2] == "1"
    assert second == [first[0], "0", "0"]


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_code_of_little_effort(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Code that was compiled with the least effort has the same bits; where better code is known, it is taken."""
    monkeypatch.setenv("ARMWRIGHT_CACHE", str(tmp_path))
    efforts, compile_ = list[bool](), native._compile

    def counted(ir: str, *, quickly: bool = False) -> bytes:
        efforts.append(quickly)
        return compile_(ir, quickly=quickly)

    monkeypatch.setattr(native, "_compile", counted)
    x = np.linspace(-3, 3, 12).reshape(4, 3)

    def value(name: str, *, quickly: bool) -> Array:
        emitted = emit("sum", lambda x: [[sin(x[0]) * x[1] + x[2] / 7]], {"x": 3}, shapes=[(1,)], origin=name)
        result: Array = Kernel(emitted=emitted, quickly=quickly)(x)
        return result

    quick, careful = value("a sum", quickly=True), value("a sum", quickly=False)
    assert efforts == [True, False]
    np.testing.assert_array_equal(quick, careful)

    np.testing.assert_array_equal(value("the same sum", quickly=False), careful)
    monkeypatch.setattr(native, "_REFERRED", {})
    np.testing.assert_array_equal(value("the same sum", quickly=True), careful)
    assert efforts == [True, False]


@pytest.mark.parametrize("name", ["tracing/graph.py", "kinematics/inverse_kinematics/branches.py", "arrays.py"])
def test_every_source_counts(name: str, tmp_path: Path) -> None:
    """The stamp of the sources changes with a file of any folder, though its length and its time remain."""
    root = shutil.copytree(ROOT, tmp_path / "armwright", ignore=shutil.ignore_patterns("__pycache__"))
    before, about = surroundings.stamp(root), (root / name).stat()
    (root / name).write_bytes((root / name).read_bytes()[::-1])
    os.utime(root / name, ns=(about.st_atime_ns, about.st_mtime_ns))

    assert before
    assert surroundings.stamp(root) != before


def test_no_reference_after_the_sources_have_changed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A process whose sources were changed after its start leaves nothing that others would find by the new ones."""
    monkeypatch.setenv("ARMWRIGHT_CACHE", str(tmp_path))
    monkeypatch.setattr(native, "sources_are_unchanged", lambda: False)
    emitted = emit("sum", lambda x: [[x[0] + 1.25]], {"x": 1}, shapes=[(1,)], origin="a sum")

    assert Kernel(emitted=emitted)([2.0]) == 3.25
    stored = [path.read_bytes() for path in (tmp_path / "compiled").iterdir()]
    assert not any(native._REFERENCE in data for data in stored)


def test_arms_that_differ_in_one_bit_have_other_origins() -> None:
    """Any number of an arm counts, the sign of a zero too, and so do its names."""
    arm = load_arm("puma560")
    others = [
        attrs.evolve(arm, tool_speed=arm.tool_speed * (1 + 1e-15)),
        attrs.evolve(arm, title=f"{arm.title}."),
        attrs.evolve(arm, joints=(attrs.evolve(arm.joints[0], d=-arm.joints[0].d), *arm.joints[1:])),
    ]
    origins = {compile_arm(one)._origin for one in (arm, *others)}

    assert len(origins) == 4
    assert compile_arm(attrs.evolve(arm))._origin in origins


def test_objects_of_other_forms_are_left_to_llvm() -> None:
    """What is no object of this processor, or refers to what is outside of it, has no image."""
    assert linked(b"", "f") is None
    assert linked(b"\xcf\xfa\xed\xfe" + bytes(200), "f") is None
    assert linked(b"\x7fELF\x02\x01\x01" + bytes(9) + struct.pack("<HH", 1, 183) + bytes(100), "f") is None


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_code_that_calls_a_library_is_left_to_llvm() -> None:
    """An object that calls a function of the C library has no image; without that call it has one, which runs."""
    calling = native._compile(
        "declare double @sin(double)\ndefine double @f(double %x) { %y = call double @sin(double %x) ret double %y }"
    )
    alone = native._compile("define i64 @f(i64 %x) { ret i64 7 }")
    image = linked(alone, "f")

    assert linked(calling, "f") is None
    assert linked(alone, "g") is None
    assert image is not None
    address, keeper = placed(image)
    import ctypes

    assert ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(address)(1) == 7
    assert keeper is not None


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_code_that_looks_up_an_address_is_left_to_llvm() -> None:
    """An object that refers to itself by a table of addresses, which an image has not, is none."""
    looking_up = "define i64 @g() { ret i64 1 }\ndefine i64 @f() { %a = ptrtoint ptr @g to i64 ret i64 %a }"

    assert linked(native._compile(looking_up), "f") is None


@pytest.mark.parametrize("begin", [0, 5])
def test_code_that_keeps_a_number_is_left_to_llvm(begin: int) -> None:
    """An object whose memory is written, which that of an image cannot be, is none."""
    counting = (
        f"@count = internal global i64 {begin}\ndefine i64 @f() {{\n%a = load i64, ptr @count\n"
        "%b = add i64 %a, 1\nstore i64 %b, ptr @count\nret i64 %b\n}"
    )

    assert linked(native._compile(counting), "f") is None


@pytest.mark.skipif(not Path("/proc/self/maps").exists() or not CAN_BE_LINKED, reason="memory is looked up in /proc")
def test_code_in_memory_cannot_be_written() -> None:
    """The memory of an image can be executed, and not written."""
    image = linked(native._compile("define i64 @f(i64 %x) { ret i64 7 }"), "f")
    assert image is not None
    address, _keeper = placed(image)

    regions = [line.split()[:2] for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()]
    (rights,) = [
        rights for region, rights in regions if int(region.split("-")[0], 16) <= address < int(region.split("-")[1], 16)
    ]
    assert rights == "r-xp"


@pytest.mark.skipif(not CAN_BE_LINKED, reason="LLVM loads objects of other forms")
def test_memory_that_cannot_be_executed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where the system refuses memory for code an error says so, when code is made and when it is found again."""

    def refused(_image: bytes) -> tuple[int, object]:
        raise OSError(13, "Permission denied")

    monkeypatch.setenv("ARMWRIGHT_CACHE", str(tmp_path))
    monkeypatch.setattr(native, "placed", refused)
    emitted = emit("sum", lambda x: [[x[0] + 1.75]], {"x": 1}, shapes=[(1,)], origin="a refused sum")
    for _ in range(2):
        with pytest.raises(ArmwrightError, match=r"memory that can be executed.*Permission denied"):
            Kernel(emitted=emitted)([2.0])


def test_another_processor_has_other_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """What one processor has compiled is not found by another, by its name, its abilities or what the system says."""
    processor = native.processor()
    keys = {native._key("some IR", "f", quickly=False)}
    for other in (processor._replace(name="another"), processor._replace(features="+another")):
        monkeypatch.setattr(native, "processor", lambda other=other: other)
        keys.add(native._key("some IR", "f", quickly=False))
    assert len(keys) == 3

    before = surroundings.surroundings.__wrapped__()
    monkeypatch.setattr(surroundings, "_host", lambda: "another")
    assert surroundings.surroundings.__wrapped__() not in ("", before)
