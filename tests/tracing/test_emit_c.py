"""Quantities of an arm in C, C++ and CUDA, compiled and compared with what this processor computes."""

import ctypes
import re
import subprocess
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.compiled.quantities import quantity_names
from armwright.compiled.source_check import check_text
from armwright.compiled.source_text import Language, arm_functions, source_text
from armwright.dynamics.inertia_matrix import massless_joint
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.closed_forms import closed_form_of
from armwright.kinematics.jacobians import jacobian
from armwright.tracing.emit import Emitted, emit
from armwright.tracing.emit_c import Argument, Function, Real, c_header, cpp_header
from armwright.tracing.identifiers import identifier
from armwright.tracing.scalar import Scalar, atan2, cbrt, exp, round_half_even, sqrt
from oracles import compilers
from oracles.arms import coupled, of_all_kinds, random_arm, with_all_friction, with_springs
from oracles.catalogue import FEW, SIX_JOINTS
from oracles.compilers import (
    COMPILERS,
    FMA,
    SANITIZED,
    Compiled,
    build,
    called_on_cortex_m7,
    compiled_for_device,
    sizes_on_cortex_m7,
)
from samples import Sample
from test_data_is_no_code import HOSTILE, random_name

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

FOR_DEVICE = "cuda as c++"
LANGUAGES: dict[str, tuple[str, Language]] = {
    "gcc": ("gcc", "c"),
    "clang": ("clang", "c"),
    "c as c++": ("g++", "c"),
    "g++": ("g++", "cpp"),
    "clang++": ("clang++", "cpp"),
    FOR_DEVICE: ("g++", "cuda"),
}
# What every text begins with that may differ where nothing else does.
_HASH = re.compile(r"SHA-256 of the code: \w{64}|ARMWRIGHT_[0-9A-F]{16}_H")


def with_slides(rng: np.random.Generator) -> Arm:
    """A random arm some of whose joints slide, of four joints."""
    while (arm := random_arm(rng, 4)).revolute.all() or not arm.revolute.any():
        pass
    return arm


def quantities_of(arm: Arm, *, real: str = "double") -> list[str]:
    """Return the quantities that an arm has.

    One with random axes has no closed form, and float has none either; an arm of the catalogue whose masses nobody
    published has no accelerations.
    """
    missing = {"inverse_branches"} if real == "float" or not has_closed_form(arm) else set()
    if massless_joint(arm) is not None:
        missing |= {"forward_dynamics", "forward_dynamics_derivatives"}
    return [name for name in quantity_names() if name not in missing]


def has_closed_form(arm: Arm) -> bool:
    """Return whether the inverse kinematics of an arm has a closed form."""
    try:
        closed_form_of(arm)
    except UnsupportedArmError:
        return False
    return True


def inputs_of(arm: Arm, quantity: str, rows: int, rng: np.random.Generator) -> list[Array]:
    """Return random inputs of a quantity, the last rows of which are wrong or unusual."""
    inputs = []
    for name, shape in compile_arm(arm).kernel(quantity).emitted.inputs.items():
        positions = rng.uniform(*ranges(arm), size=(rows, arm.n))
        if name == "pose":
            inputs.append(forward(arm, positions))
        else:
            inputs.append(positions if name in {"q", "near"} else rng.normal(scale=3.0, size=(rows, *shape)))
    for k, value in enumerate((np.nan, np.inf, 1e150, 200.0, -1e13), start=1):
        inputs[k % len(inputs)].reshape(rows, -1)[-k, k % 3] = value
    return inputs


def assert_same_bits(name: str, arm: Arm, names: list[str], folder: Path, rng: np.random.Generator) -> int:
    """Quantities of an arm have the bits and the statuses of the processor's kernels; return how many rows."""
    compiler, language = LANGUAGES[name]
    compared = 0
    other = Compiled(arm, names, folder, compiler=compiler, language=language)
    for quantity in names:
        inputs, kernel = inputs_of(arm, quantity, 150, rng), compile_arm(arm).kernel(quantity)
        outputs, statuses = other(quantity, *inputs)
        for row in range(len(statuses)):
            one = [np.ascontiguousarray(x[row]) for x in inputs]
            expected = [np.empty(shape, kind) for shape, kind in kernel._passed[1]]
            assert kernel._run(one, (), expected, None) == statuses[row], (quantity, row)
            if statuses[row] != 1:
                assert [x[row].tobytes() for x in outputs] == [x.tobytes() for x in expected], (quantity, row)
                compared += 1
        assert 1 in statuses
        assert 0 in statuses
    return compared


@pytest.mark.parametrize("kind", ["catalogue", "random"])
@pytest.mark.parametrize("name", LANGUAGES)
@pytest.mark.drawn(0.09)
def test_bits_of_the_processor(name: str, kind: str, tmp_path: Path, sample: Sample) -> None:
    """Every quantity has the same bits and statuses in each language as in the kernel of this processor."""
    rng = np.random.default_rng(sample.seed)
    arm = load_arm(str(rng.choice(SIX_JOINTS))) if kind == "catalogue" else with_slides(rng)
    rows = assert_same_bits(name, arm, quantities_of(arm), tmp_path, rng)
    sample.record(f"rows of all quantities with the processor's bits, {name}, {kind}", rows, 0)


@pytest.mark.parametrize("name", LANGUAGES)
@pytest.mark.drawn(0.2)
def test_loops_of_long_arms(name: str, tmp_path: Path, sample: Sample) -> None:
    """Loops over the links of a long arm stay loops, with the bits of the processor, and no text gets much longer."""
    rng = np.random.default_rng(sample.seed)
    arm = of_all_kinds(random_arm(rng, 20), rng)
    language = LANGUAGES[name][1]
    names = ["inverse_dynamics", "inverse_dynamics_with_wrench", "forward_dynamics"]

    rows = assert_same_bits(name, arm, names, tmp_path, rng)

    half = attrs.evolve(arm, joints=arm.joints[:10], links=arm.links[:10], motors=arm.motors[:10])
    texts = [source_text(one, names[:1], language) for one in (half, arm)]
    # On a device, arms that are straight code on the processor are so, too: the shorter one may be.
    loops = ["for (int i = 0; i < " in text for text in texts]
    assert loops[1]
    assert loops[0] or language == "cuda"
    # A loop has one body for each kind of link, and the longer arm may have more kinds.
    bodies = [max(1, text.count("_kind[i] == ")) for text in texts]
    assert not loops[0] or len(texts[1]) * bodies[0] < 1.7 * len(texts[0]) * max(bodies)
    sample.record(f"rows of an arm of 20 joints with the processor's bits, {name}", rows, 0)


@pytest.mark.parametrize("name", LANGUAGES)
@pytest.mark.parametrize("joints", [3, 20])
@pytest.mark.drawn(0.25)
def test_friction_of_all_kinds(name: str, joints: int, tmp_path: Path, sample: Sample) -> None:
    """Exponentials and cube roots of an arm's friction have the bits of the processor, in loops over links, too."""
    rng = np.random.default_rng(sample.seed)
    arm = with_springs(with_all_friction(random_arm(rng, joints), rng), rng)
    arm = attrs.evolve(arm, motors=[attrs.evolve(motor, stribeck=1.0, cube_root=2.0) for motor in arm.motors])
    names = ["inverse_dynamics", "forward_dynamics", "potential_energy"]
    names += ["inverse_dynamics_derivatives", "regressor"] if joints < 5 else []

    rows = assert_same_bits(name, arm, names, tmp_path, rng)

    sample.record(f"rows of arms with friction of all kinds with the processor's bits, {name}", rows, 0)


@pytest.mark.parametrize("name", LANGUAGES)
@pytest.mark.parametrize("joints", [4, 20])
@pytest.mark.drawn(0.15)
def test_coupled_drives(name: str, joints: int, tmp_path: Path, sample: Sample) -> None:
    """Drives that move several joints have the bits of the processor, in arms of which loops stay loops, too."""
    rng = np.random.default_rng(sample.seed)
    arm = coupled(with_all_friction(random_arm(rng, joints), rng), rng)
    names = ["inverse_dynamics", "kinetic_energy"]
    names += ["forward_dynamics", "mass_and_bias", "forward_dynamics_derivatives", "regressor"] if joints < 5 else []

    rows = assert_same_bits(name, arm, names, tmp_path, rng)

    sample.record(f"rows of arms with coupled drives with the processor's bits, {name}", rows, 0)


@pytest.mark.parametrize("compiler", ["gcc", "g++"])
def test_sums_of_neighbours(compiler: str, tmp_path: Path, rng: np.random.Generator) -> None:
    """Products that stay by themselves are rounded, though gcc would make one instruction of them and their sums."""

    def equation(a: list[Scalar], b: list[Scalar]) -> list[list[Scalar]]:
        # The last of each are used in another way, too: so no sum takes them in.
        products = [x * y for x, y in zip(a, b, strict=True)]
        return [[x + y if k % 2 else x - y for k, (x, y) in enumerate(zip(products, b, strict=True))], products]

    emitted = emit("neighbours", equation, {"a": 4, "b": 4})
    arguments = [Argument(name, 4) for name in ("a", "b", "sums", "products")]
    function = Function(
        "neighbours", emitted.code, emitted.any_type, arguments[:2], arguments[2:], emitted.operations, ["Sums."]
    )
    text, prefix = (c_header([function]), "") if compiler == "gcc" else (cpp_header([function]), "armwright::")
    export = 'extern "C" ' if compiler == "g++" else ""
    text += f"""
{export}int call(const double *x, double *y);
{export}int call(const double *x, double *y)
{{
    return {prefix}neighbours(x, x + 4, y, y + 4);
}}
"""
    call = ctypes.CDLL(str(build(compiler, text, tmp_path / "neighbours.so", "-O3", *FMA))).call

    for x in rng.normal(size=(200, 8)):
        found = np.empty(8)
        assert call(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(found.ctypes.data)) == 0
        products = x[:4] * x[4:]
        sums = products + x[4:] * (-1, 1, -1, 1)
        np.testing.assert_array_equal(found, [*sums, *products])


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.drawn(0.13)
def test_test_programs(compiler: str, real: Real, tmp_path: Path, rng: np.random.Generator) -> None:
    """The program that comes with the text finds it right, without undefined behaviour on its way."""
    arm = load_arm(str(rng.choice(SIX_JOINTS))) if rng.random() < 0.5 else with_slides(rng)
    names = quantities_of(arm, real=real)
    text = check_text(arm, names, "c" if COMPILERS[compiler][1] == ".c" else "cpp", real)

    program = build(compiler, text, tmp_path / "program", *SANITIZED["clang" if "clang" in compiler else "gcc"])

    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert done.stdout.count("0 of 20 refused") == len(names)


def test_no_accelerations_without_masses() -> None:
    """A text of accelerations is refused for an arm without masses: it could refuse each row only."""
    for name in ("forward_dynamics", "forward_dynamics_derivatives"):
        with pytest.raises(UnsupportedArmError, match="joint 6 moves no mass and has no finite acceleration; specify"):
            source_text(load_arm("irb140"), [name], "c")


def test_test_program_finds_an_error(tmp_path: Path) -> None:
    """A text in which one number is off by a millionth fails its test."""
    text = check_text(load_arm("stanford"), ["jacobian"], "c")
    number = re.search(r"= ARMWRIGHT_FMA\(\w+, (-?\d\.\d+), v", text[text.index("bit(") :])
    assert number is not None
    wrong = text.replace(f", {number[1]},", f", {float(number[1]) + 1e-6!r},")
    assert wrong != text
    program = build("gcc", wrong, tmp_path / "program")
    assert subprocess.run([program], capture_output=True, check=False).returncode == 1


@pytest.mark.parametrize(
    ("meddled", "status"),
    [
        ("if (row == 3) out[0] += 1e-9;", 0),  # the efforts go up to hundreds
        ("if (row == 3) out[0] += 1e-4;", 1),
        ("if (row == 3) out[0] = NAN;", 1),
        ("if (row == 3) out[0] = HUGE_VAL;", 1),
        ("if (row == 3) refused++;", 1),
    ],
)
def test_what_a_test_program_refuses(meddled: str, status: int, tmp_path: Path) -> None:
    """One number that is wrong or none, or one refusal, is enough, wherever it is; less than the tolerance is not."""
    text = check_text(load_arm("stanford"), ["potential_energy"], "c")
    call, end = "refused += stanford_potential_energy", " != 0;\n"
    start = text.index(end, text.index(call)) + len(end)

    program = build("gcc", f"{text[:start]}{meddled}\n{text[start:]}", tmp_path / "program")

    assert subprocess.run([program], capture_output=True, check=False).returncode == status


@pytest.mark.drawn(0.02)
@pytest.mark.parametrize("name", SIX_JOINTS)
def test_float(name: str, tmp_path: Path, sample: Sample) -> None:
    """Efforts in float are off by at most a hundred-thousandth of their range."""
    arm, rng = load_arm(name), np.random.default_rng(sample.seed)
    inputs = [rng.uniform(*ranges(arm), size=(4000, 6)), *rng.normal(scale=3.0, size=(2, 4000, 6))]
    inputs = [x.astype(np.float32).astype(float) for x in inputs]
    expected = inverse_dynamics(arm, *inputs)

    (tau,), status = Compiled(arm, ["inverse_dynamics"], tmp_path, real="float")("inverse_dynamics", *inputs)

    # A joint that moves nothing takes no effort, in float either.
    spans = np.ptp(expected, axis=0)
    error = (np.abs(tau - expected).max(axis=0) / np.where(spans > 0, spans, 1.0)).max()
    assert not status.any()
    assert error < 1e-5
    sample.record(f"efforts in float, {name}", len(tau), 0, error=float(error))


def very_heavy(arm: Arm) -> Arm:
    """The arm with masses near the end of the range of float."""
    return attrs.evolve(arm, links=[attrs.evolve(link, mass=link.mass * 1e30) for link in arm.links])


def test_both_types_in_one_program(tmp_path: Path) -> None:
    """The headers of double and float may be included in one program, beside headers with macros for old pointers."""
    arm, real = load_arm("ur5"), ("double", "float")
    headers = [source_text(arm, ["inverse_dynamics", "forward"], "c", x) for x in real]
    headers.append(source_text(arm, ["inverse_branches"], "c"))
    text = "\n".join(["#define near", "#define far", "#define small char", *headers])

    assert build("gcc", f"{text}\nint f(void);\nint f(void) {{ return 0; }}\n", tmp_path / "both.o").exists()


def test_float_knows_its_range(tmp_path: Path) -> None:
    """Inputs whose squares float cannot hold have no meaning there, nor have a number of the arm beyond it."""
    arm = load_arm("ur5")
    of_arm = Compiled(arm, ["inverse_dynamics"], tmp_path, real="float")
    inputs = [np.zeros((4, 6)) for _ in range(3)]
    inputs[1][0, 3], inputs[2][1, 0], inputs[0][2, 0] = 1.1e15, np.nan, 1.1e12

    assert of_arm("inverse_dynamics", *inputs)[1].tolist() == [1, 1, 1, 0]
    inputs = [np.zeros((2, 6)) for _ in range(3)]
    inputs[1][0] = 9e14
    folder = tmp_path / "heavy"
    folder.mkdir()
    of_heavy = Compiled(very_heavy(arm), ["inverse_dynamics"], folder, real="float")
    (tau,), status = of_heavy("inverse_dynamics", *inputs)
    assert not np.isfinite(tau[0]).all()
    assert np.isfinite(tau[1]).all()
    assert status.tolist() == [1, 0]
    with pytest.raises(InvalidValueError, match="real: expected double for inverse_branches, got float"):
        source_text(arm, ["inverse_branches"], "c", "float")
    with pytest.raises(InvalidValueError, match="real: expected double for cuda, got float"):
        source_text(arm, ["forward"], "cuda", "float")
    heavy = attrs.evolve(arm, links=[attrs.evolve(link, mass=link.mass * 1e40) for link in arm.links])
    with pytest.raises(InvalidValueError, match=r"real: expected double, as the number .* beyond the range of float"):
        source_text(heavy, ["inverse_dynamics"], "c", "float")


def function_of(emitted: Emitted) -> Function:
    inputs = [Argument(name, shape[0]) for name, shape in emitted.inputs.items()]
    outputs = [Argument(f"out{i}", *shape, i in emitted.flags) for i, shape in enumerate(emitted.outputs)]
    return Function("of", emitted.code, emitted.any_type, inputs, outputs, emitted.operations)


@pytest.mark.parametrize("header", [c_header, cpp_header], ids=["c", "cpp"])
def test_whole_numbers_angles_and_flags(header: object, tmp_path: Path) -> None:
    """Elementary functions, flags, infinite constants and unused inputs compile without a warning."""

    def equation(x: list[Scalar], _: list[Scalar]) -> list[list[Scalar]]:
        several = [round_half_even(x[0]), sqrt(x[1]), atan2(x[0], x[1]), x[0] * np.inf, abs(x[1])]
        return [[*several, exp(x[1]), cbrt(2 * x[1])], [x[0] < x[1]]]

    emitted = emit("all", equation, {"x": 2, "y": 1}, flags=(1,))
    text = header([function_of(emitted)])  # type: ignore[operator]
    language = header is cpp_header
    called = "armwright::of<double>" if language else "of"
    main = (
        f"int main(void) {{ double x[2] = {{2.5, -4}}, y[1] = {{0}}, z[7]; unsigned char flag[1]; return !({called}(x, "
        "y, z, flag) == 0 && z[0] == 2 && z[1] == 0 && z[2] > 2.58 && z[2] < 2.59 && z[3] > 1e308 && z[4] == 4 "
        "&& z[5] > 0.0183156 && z[5] < 0.0183157 && z[6] == -2 "
        "&& flag[0] == 0); }\n"
    )
    program = build("g++" if language else "gcc", text + main, tmp_path / "program")
    assert subprocess.run([program], check=False).returncode == 0


def test_another_multiply_add(tmp_path: Path) -> None:
    """Where a program has its own instruction for a multiplication and an addition, the text compiles with it."""
    text = source_text(load_arm("ur5"), ["forward"], "c")
    own = "#include <math.h>\n#define ARMWRIGHT_FMA(a, b, c) (calls++, fma(a, b, c))\nstatic int calls;\n"
    main = "int main(void) { double q[6] = {0}, X[16]; return !(ur5_forward(q, X) == 0 && calls > 0); }\n"

    assert subprocess.run([build("gcc", own + text + main, tmp_path / "own")], check=False).returncode == 0


def test_program_without_angles(tmp_path: Path) -> None:
    """The test program of an arm that only slides has no function that nothing calls."""
    slide = Arm(name="slide", joints=[Joint(kind="prismatic")], links=[Link(mass=1.0)])
    text = check_text(slide, ["inverse_dynamics"], "c")

    assert subprocess.run([build("clang", text, tmp_path / "slide", "-O2")], check=False).returncode == 0


# A number and its derivative, as a library for automatic differentiation has it.
DUAL = """
struct Dual {
    double x, d;
    Dual(double value = 0.0, double slope = 0.0) : x(value), d(slope) {}
};
inline Dual operator-(Dual a) { return Dual(-a.x, -a.d); }
inline Dual operator+(Dual a, Dual b) { return Dual(a.x + b.x, a.d + b.d); }
inline Dual operator-(Dual a, Dual b) { return Dual(a.x - b.x, a.d - b.d); }
inline Dual operator*(Dual a, Dual b) { return Dual(a.x * b.x, a.x * b.d + a.d * b.x); }
inline Dual operator/(Dual a, Dual b) { return Dual(a.x / b.x, (a.d * b.x - a.x * b.d) / (b.x * b.x)); }
inline bool operator<(Dual a, Dual b) { return a.x < b.x; }
inline bool operator<=(Dual a, Dual b) { return a.x <= b.x; }
inline Dual sin(Dual a) { return Dual(std::sin(a.x), a.d * std::cos(a.x)); }
inline Dual cos(Dual a) { return Dual(std::cos(a.x), -a.d * std::sin(a.x)); }
inline Dual abs(Dual a) { return a.x < 0.0 ? -a : a; }
"""


def test_template_on_another_type(tmp_path: Path) -> None:
    """With dual numbers the template of the tool pose gives the linear rows of the Jacobian."""
    arm = load_arm("stanford")
    text = source_text(arm, ["forward", "jacobian"], "cpp")
    main = """
#include <cstdio>
int main() {
    double q[6] = {0.3, -0.7, 0.5, 1.1, -0.4, 2.0}, J[36], error = 0.0;
    int bad = armwright::stanford_jacobian(q, J);
    for (int k = 0; k < 6; k++) {
        Dual at[6], X[16];
        for (int i = 0; i < 6; i++) at[i] = Dual(q[i], i == k);
        bad += armwright::stanford_forward(at, X);
        for (int r = 0; r < 3; r++) error = std::fmax(error, std::fabs(X[4 * r + 3].d - J[6 * r + k]));
    }
    std::printf("%d %.17g %.17g\\n", bad, error, J[0]);
}
"""
    done = subprocess.run([build("g++", text + DUAL + main, tmp_path / "dual")], capture_output=True, check=True)

    bad, error, first = map(float, done.stdout.split())
    assert (bad, error < 1e-15) == (0, True)
    assert first == pytest.approx(jacobian(arm, [0.3, -0.7, 0.5, 1.1, -0.4, 2.0])[0, 0], abs=1e-15)


@pytest.mark.parametrize("target", ["aarch64-linux-musl", "x86_64-windows-gnu", "riscv64-linux-musl", "wasm32-wasi"])
@pytest.mark.drawn(0.25)
def test_other_processors(target: str, tmp_path: Path) -> None:
    """The header compiles without a warning for other processors and systems."""
    text = source_text(load_arm("ur5"), ["inverse_dynamics", "forward_dynamics"], "c")
    (tmp_path / "ur5.h").write_text(text, encoding="ascii")
    sums = "ur5_inverse_dynamics(x, x, x, x) + ur5_forward_dynamics(x, x, x, x)"
    call = f"int f(double *x);\nint f(double *x) {{ return {sums}; }}\n"
    build("clang", f'#include "ur5.h"\n#include "ur5.h"\n{call}', tmp_path / "other.o", "-target", target)


def test_stack(tmp_path: Path) -> None:
    """Without optimisation the stack holds what the comment says, and with it less than half of that."""
    text = source_text(load_arm("puma560"), ["inverse_dynamics"], "c")
    found = re.search(
        r"On the stack are at most (\d+) numbers and (\d+) truth values", unwrapped(text.replace("*", ""))
    )
    assert found is not None
    numbers, truths = map(int, found.groups())
    bound = 8 * numbers + 4 * truths
    used = []
    for level in ("-O0", "-O2"):
        build("gcc", text + "int f(double *x) { return puma560_inverse_dynamics(x, x, x, x); }\n", tmp_path / "s.o",
              level, "-fstack-usage")  # fmt: skip
        used.append(sum(int(line.split()[1]) for line in (tmp_path / "s.su").read_text().splitlines()))

    assert 0.5 * bound < used[0] < bound + 512
    assert used[1] < 0.5 * bound


def test_output_in_the_place_of_an_input(tmp_path: Path) -> None:
    """An array may be input and output of one call."""
    arm = load_arm("ur5")
    of_arm = Compiled(arm, ["inverse_dynamics"], tmp_path)
    q, qd, qdd = np.linspace(-1.0, 1.0, 18).reshape(3, 1, 6)
    (expected,), _ = of_arm("inverse_dynamics", q, qd, qdd)
    shared = qd.copy()

    of_arm.into("inverse_dynamics", q, shared, qdd, shared)

    assert shared.tolist() == expected.tolist()


def call_of_puma(real: Real) -> str:
    """Text of a function that calls the inverse dynamics of a Puma."""
    name = "puma560_inverse_dynamics" + "_float" * (real == "float")
    return f"int f({real} *x);\nint f({real} *x) {{ return {name}(x, x + 6, x + 12, x); }}\n"


def test_cortex_m7(tmp_path: Path) -> None:
    """Inverse dynamics of a Puma takes at most 6 KB of a microcontroller's flash, and none of its memory."""
    sizes: dict[Real, int] = {"double": 6 * 1024, "float": 4 * 1024}
    for real, largest in sizes.items():
        text = source_text(load_arm("puma560"), ["inverse_dynamics"], "c", real)
        call = call_of_puma(real)
        size, *of_data = sizes_on_cortex_m7(text + call, tmp_path)
        assert 1000 < size <= largest
        assert of_data == [0, 0]


@pytest.mark.parametrize(("compiler", "language"), [("gcc", "c"), ("g++", "cpp")])
def test_strict_projects(compiler: str, language: Language, tmp_path: Path) -> None:
    """The text keeps more rules than all our other tests ask for, as projects that include it do."""
    text = source_text(load_arm("ur5"), ["inverse_dynamics", "inverse_branches"], language)
    of_language = {"c": ["-Wundef", "-Wbad-function-cast"], "cpp": ["-std=c++17", "-Wold-style-cast", "-Wuseless-cast"]}
    call = {"c": "int f(void);\nint f(void)", "cpp": "int f();\nint f()"}[language]
    scope = {"c": "", "cpp": "armwright::"}[language]
    body = f"{{ double a[48] = {{0.0}}; return {scope}ur5_inverse_dynamics(a, a, a, a); }}\n"
    rules = ["-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wdouble-promotion", "-Wcast-qual", "-Wcast-align"]

    assert build(compiler, f"{text}{call} {body}", tmp_path / "strict.o", *rules, *of_language[language]).exists()


@pytest.mark.parametrize("real", ["double", "float"])
def test_cortex_m7_without_a_library(real: Real, tmp_path: Path) -> None:
    """A joined multiplication is an instruction for a microcontroller without an operating system, too: no call."""
    text = source_text(load_arm("puma560"), ["inverse_dynamics"], "c", real)
    call = call_of_puma(real)

    called = called_on_cortex_m7(text + call, tmp_path)

    assert called & {"fabs", "fabsf"}  # the compiler assumes nothing of the library
    assert not called & {"fma", "fmaf"}


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", SIX_JOINTS)
def test_registers_of_a_device(name: str) -> None:
    """Inverse dynamics of an arm of six joints fits into 128 registers: nothing is spilled to memory."""
    log = compiled_for_device(source_text(load_arm(name), ["inverse_dynamics"], "cuda"))

    assert "0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads" in log
    (registers,) = re.findall(r"Used (\d+) registers", log)
    assert int(registers) <= 128


def test_results_in_the_place_of_inputs(tmp_path: Path, rng: np.random.Generator) -> None:
    """A result that is an input, as the height of a hand that slides, is that input, though others were written first.

    A few numbers of a row take the place of its inputs in the memory that a block shares.
    """
    arm = Arm(name="crane", joints=[Joint(kind="revolute"), Joint(kind="prismatic")], links=[Link(mass=1.0)] * 2)
    names = ["forward", "base_regressor"]
    on_device = Compiled(arm, names, tmp_path, compiler="g++", language="cuda")
    motion = rng.normal(size=(3, 130, 2))

    for name, inputs in zip(names, (motion[:1], motion), strict=True):
        (found,), _ = on_device(name, *inputs)
        expected = getattr(compile_arm(arm), name)(*inputs)
        assert any((expected.reshape(130, -1) == x[:, 1:]).all(axis=0).any() for x in inputs)
        np.testing.assert_array_equal(found.reshape(expected.shape), expected)


@pytest.mark.parametrize("barrier", range(3))
def test_missing_barriers_show(barrier: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without one of the barriers between the threads of a block, rows come out wrong."""
    arm, text = load_arm("stanford"), source_text(load_arm("stanford"), ["jacobian"], "cuda")
    parts = text.split("__syncthreads();")
    assert len(parts) == 4
    wrong = "__syncthreads();".join([*parts[:barrier], parts[barrier] + parts[barrier + 1], *parts[barrier + 2 :]])
    q = np.linspace(-1.0, 1.0, 300 * 6).reshape(300, 6)
    expected = compile_arm(arm).jacobian(q)

    monkeypatch.setattr(compilers, "source_text", lambda *_: wrong)
    (J,), _ = Compiled(arm, ["jacobian"], tmp_path, compiler="g++", language="cuda")("jacobian", q)

    assert not np.array_equal(J, expected.reshape(300, 36))


def test_long_arms_of_a_device(rng: np.random.Generator) -> None:
    """Inverse dynamics of a long arm stays a loop on a device: nothing is spilled."""
    log = compiled_for_device(source_text(random_arm(rng, 20), ["inverse_dynamics"], "cuda"))

    assert "0 bytes spill stores, 0 bytes spill loads" in log


@pytest.mark.drawn(0.1)
@pytest.mark.parametrize("quantity", quantity_names())
def test_quantities_for_a_device(quantity: str) -> None:
    """The compiler of a device takes every quantity."""
    assert "Used" in compiled_for_device(source_text(load_arm("stanford"), [quantity], "cuda"))


# ---- names ----


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ur5", "ur5"), ("stanford-jpl", "stanford_jpl"), ("", "x"), ("__a__b", "a_b"), ("int", "int_2"),
        ("7 axes", "x_7_axes"), ("é", "x"), ("v12", "v12_2"), ("class", "class_2"), ("NAN", "NAN_2"), ("_Bool", "Bool"),
        ("a" * 100, "a" * 48),
    ],
)  # fmt: skip
def test_identifiers(name: str, expected: str) -> None:
    """A name keeps its letters and digits, and differs from what the language and the text call otherwise."""
    assert identifier(name) == expected
    assert identifier(name, [expected]) != expected
    assert identifier(name, [expected, f"{expected}_2"]) not in {expected, f"{expected}_2"}


def plain(text: str, prefix: str) -> str:
    """Return a text without its hash and the name of its arm."""
    return (
        _HASH.sub("", text)
        .replace(f" {prefix}_forward", " name_forward")
        .replace(f"\n{prefix}_forward", " name_forward")
    )


def unwrapped(text: str) -> str:
    """Return a text as if lines had no end, which depends on the length of names."""
    return " ".join(text.split())


@pytest.mark.parametrize("language", ["c", "cpp", "cuda"])
@pytest.mark.share(0.01)
def test_hostile_names(language: Language, sample: Sample) -> None:
    """Whatever an arm is called, its name is an identifier in the text, and nothing else of the text changes."""
    arm = load_arm("ntu-3r")
    expected = unwrapped(plain(source_text(arm, ["forward"], language), "ntu_3r"))
    names = [*HOSTILE.values(), *(random_name(rng) for rng in sample.cases(3_400))]
    for name in names:
        hostile = attrs.evolve(arm, name=name, title=name, source=name)
        (function,) = arm_functions(hostile, ["forward"], "c")
        prefix = function.name.removesuffix("_forward")
        text = source_text(hostile, ["forward"], language)
        assert re.fullmatch(r"[A-Za-z](?:_?[A-Za-z0-9])*", prefix)
        assert unwrapped(plain(text, prefix)) == expected, name
    sample.record(f"hostile names of arms in {language}", len(names), 0)


@pytest.mark.share(0.05)
def test_text_of_hostile_names_compiles(tmp_path: Path, sample: Sample) -> None:
    """Texts of arms with hostile names stand in one program."""
    arm = load_arm("ntu-3r")
    texts = {}
    for name in [*HOSTILE.values(), *(random_name(rng) for rng in sample.cases(1000))]:
        hostile = attrs.evolve(arm, name=name, title=name)
        texts[arm_functions(hostile, ["forward"], "c")[0].name] = source_text(hostile, ["forward"], "c")
    build("gcc", "\n".join(texts.values()), tmp_path / "all.o")
    sample.record("texts of hostile names compiled in one program", len(texts), 0)
