"""Arms on a device of CUDA: what is launched, with a stand-in for the device, and a real one where it is."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.compiled import device_arm
from armwright.compiled.arm import CompiledArm, compile_arm
from armwright.compiled.quantities import quantity_names
from armwright.errors import DeviceError, InvalidValueError, KindError, MissingExtraError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from oracles.catalogue import FEW, SIX_JOINTS
from oracles.devices import FakeCuda, OnDevice


@pytest.fixture
def fake(tmp_path: Path) -> FakeCuda:
    return FakeCuda(load_arm("stanford"), tmp_path)


def motion(rows: int, rng: np.random.Generator) -> list[Array]:
    arm = load_arm("stanford")
    return [rng.uniform(*ranges(arm), size=(rows, 6)), *rng.normal(scale=3.0, size=(2, rows, 6))]


def test_parts_of_arrays(fake: FakeCuda, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Arrays of the host go to the device part by part, and come back with the bits of the processor."""
    monkeypatch.setattr(device_arm, "_PART", 200 * 24 * 8)
    arm, inputs = fake.arm(monkeypatch), motion(500, rng)
    expected = compile_arm(arm.arm).inverse_dynamics(*inputs)

    assert arm.inverse_dynamics(*inputs).tobytes() == expected.tobytes()
    assert fake.launches == [200, 200, 100]
    shaped = arm.inverse_dynamics(*(x.reshape(2, 250, 6)[:, ::-1] for x in inputs))
    assert shaped.tobytes() == expected.reshape(2, 250, 6)[:, ::-1].tobytes()
    assert arm.inverse_dynamics(*(x[3].tolist() for x in inputs)).tobytes() == expected[3].tobytes()
    assert arm.inverse_dynamics(inputs[0][:9], inputs[1][0], inputs[2][:9]).shape == (9, 6)
    assert arm.inverse_dynamics(*np.zeros((3, 0, 6))).shape == (0, 6)
    out = inputs[0].copy()
    assert arm.inverse_dynamics(out, *inputs[1:], out=out, threads=1) is out
    assert out.tobytes() == expected.tobytes()
    assert fake.context == 77


def test_arrays_on_the_device(fake: FakeCuda, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Arrays on the device stay there, several outputs and truth values with them."""
    arm, q = fake.arm(monkeypatch), motion(129, rng)[0]
    of_processor = compile_arm(arm.arm)

    q_found, singular = arm.inverse_branches(OnDevice(forward(arm.arm, q)), OnDevice(q))  # type: ignore[arg-type]

    expected = of_processor.inverse_branches(forward(arm.arm, q), q)
    assert [x.array.tobytes() for x in (q_found, singular)] == [x.tobytes() for x in expected]  # type: ignore[attr-defined]
    assert fake.seen_streams == [5, 5]
    out = OnDevice(np.empty((129, 4, 4)))
    assert arm.forward(OnDevice(q), out=out) is out  # type: ignore[arg-type]
    assert out.array.tobytes() == of_processor.forward(q).tobytes()
    assert arm.forward(OnDevice(np.empty((0, 6)))).shape == (0, 4, 4)  # type: ignore[arg-type]
    assert arm.forward(OnDevice(q[5])).array.tobytes() == of_processor.forward(q[5]).tobytes()  # type: ignore[attr-defined,arg-type]


@pytest.mark.parametrize(
    ("error", "message", "arguments", "options"),
    [
        (KindError, "all inputs on the device or none", (OnDevice(np.zeros(6)), np.zeros(6), np.zeros(6)), {}),
        (KindError, "q: expected float64 on the device, got float32", [OnDevice(np.zeros(6, "f"))] * 3, {}),
        (ShapeError, "q: expected shape", [OnDevice(np.zeros(5))] * 3, {}),
        (ShapeError, "qd: .*broadcasts nothing", [OnDevice(np.zeros((n, 6))) for n in (3, 1, 3)], {}),
        (ShapeError, "q: expected an array in C order", [OnDevice(np.zeros((6, 6)).T)] * 3, {}),
        (InvalidValueError, "q: expected an array on device 0, got one on device 1", [OnDevice(np.ones(6), 1)] * 3, {}),
        (ShapeError, "out: expected 1 arrays on the device", [OnDevice(np.zeros(6))] * 3, {"out": np.zeros(6)}),
        (InvalidValueError, "threads: expected an integer above 0", [np.zeros(6)] * 3, {"threads": 0}),
    ],
)
def test_refusals(error, message, arguments, options, fake: FakeCuda, monkeypatch) -> None:  # noqa: PLR0917
    """Arrays that a kernel cannot take are refused by name."""
    with pytest.raises(error, match=message):
        fake.arm(monkeypatch).inverse_dynamics(*arguments, **options)
    assert fake.launches == []


def test_arrays_to_fill(fake: FakeCuda, monkeypatch: pytest.MonkeyPatch) -> None:
    """An array to fill on the device must be writable, and apart from the inputs."""
    zeros = np.zeros((4, 6))
    fixed = np.zeros((4, 6))
    fixed.flags.writeable = False
    inputs = [OnDevice(zeros)] * 3
    for array, message in ((zeros, "apart from each other and the inputs"), (fixed, "expected a writable array")):
        with pytest.raises(ShapeError, match=message):
            fake.arm(monkeypatch).inverse_dynamics(*inputs, out=OnDevice(array))  # type: ignore[arg-type]


@pytest.mark.parametrize("wrap", [np.asarray, OnDevice], ids=["host", "device"])
def test_errors_of_the_processor(wrap, fake: FakeCuda, monkeypatch, rng: np.random.Generator) -> None:
    """What the kernel of the processor refuses is refused in the same words, and degrees get the same warning."""
    arm, of_processor, inputs = fake.arm(monkeypatch), compile_arm(load_arm("stanford")), motion(300, rng)
    for k, value in enumerate((np.nan, np.inf, 1e150, 1e13)):
        wrong = [x.copy() for x in inputs]
        wrong[k % 3][130 + k, 2] = value
        if value == 1e13:
            wrong[0][7, 0] = value
        with pytest.raises(InvalidValueError) as expected:
            of_processor.inverse_dynamics(*wrong)
        with pytest.raises(InvalidValueError) as error:
            arm.inverse_dynamics(*map(wrap, wrong))
        assert str(error.value) == str(expected.value)
    inputs[0][200, 0] = 200.0
    with pytest.warns(UserWarning, match="degrees") as warned:
        arm.inverse_dynamics(*map(wrap, inputs))
    assert warned[0].filename == __file__


def test_error_of_the_driver(fake: FakeCuda, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of the driver has the name that the driver gives it, and the thread gets its context back."""
    arm = fake.arm(monkeypatch)
    fake.fails = "cuMemcpyHtoDAsync"
    with pytest.raises(DeviceError, match="CUDA_ERROR_OUT_OF_MEMORY"):
        arm.forward(np.zeros(6))
    assert fake.context == 77
    monkeypatch.setattr("os.getpid", lambda: -1)
    with pytest.raises(DeviceError, match="opened before this process was forked"):
        arm.forward(np.zeros(6))


def test_functions(fake: FakeCuda, monkeypatch: pytest.MonkeyPatch) -> None:
    """An arm on a device has the functions of every compiled arm."""
    arm = fake.arm(monkeypatch)
    for name in quantity_names():
        function = getattr(arm, name)
        assert (function.__name__, function.__doc__) == (name, getattr(CompiledArm, name).__doc__)


def test_names_of_devices() -> None:
    """A device is called cuda, or by its number."""
    assert [device_arm.device_number(x) for x in ("cuda", "cuda:3")] == [0, 3]
    with pytest.raises(InvalidValueError, match="device: expected cuda or a number such as cuda:1, got 'gpu'"):
        compile_arm(load_arm("ur5"), device="gpu")
    with pytest.raises(InvalidValueError, match="device: expected cuda or a number such as cuda:1, got 0"):
        compile_arm(load_arm("ur5"), device=0)  # type: ignore[arg-type]


def test_no_device() -> None:
    """A device that no machine has is an error that says so."""
    with pytest.raises(DeviceError, match="no device 999 of CUDA"):
        compile_arm(load_arm("ur5"), device="cuda:999")


def test_no_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra, the error has the command that installs it."""
    monkeypatch.setitem(__import__("sys").modules, "cuda.core", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armwright\[cuda\]'"):
        compile_arm(load_arm("ur5"), device="cuda")


def test_names_of_the_library() -> None:
    """The library has what is asked of it, under these names."""
    core = __import__("cuda.core", fromlist=["core"])
    driver = __import__("cuda.bindings.driver", fromlist=["driver"])
    for name in ("Device", "Program", "ProgramOptions", "LaunchConfig", "launch", "LEGACY_DEFAULT_STREAM"):
        assert hasattr(core, name)
    for name in ("cuInit", "cuCtxGetCurrent", "cuCtxSetCurrent", "cuMemcpyHtoDAsync", "cuMemcpyDtoHAsync"):
        assert callable(getattr(driver, name))
    assert callable(core.Buffer.set_deallocation_stream)
    view = core.utils.StridedMemoryView.from_any_interface(np.ones((3, 6)), stream_ptr=-1)
    assert (view.shape, view.dtype, view.readonly, view.device_id) == ((3, 6), np.dtype(float), False, -1)
    assert callable(view.from_buffer)
    assert callable(view.__dlpack__)


@pytest.mark.cuda
@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", SIX_JOINTS)
def test_bits_on_a_device(name: str, rng: np.random.Generator) -> None:
    """Every quantity of an arm has the bits of the processor on a device."""
    arm = load_arm(name)
    try:
        on_device = compile_arm(arm, device="cuda")
    except DeviceError as error:
        pytest.skip(f"needs a device of CUDA: {error}")
    of_processor = compile_arm(arm)
    for quantity in quantity_names():
        shapes = of_processor.kernel(quantity).emitted.inputs
        q = rng.uniform(*ranges(arm), size=(1001, 6))
        given = {"q": q, "near": q, "pose": forward(arm, q)}
        inputs = [given.get(key, rng.normal(size=(1001, *shape))) for key, shape in shapes.items()]
        found, expected = (getattr(x, quantity)(*inputs) for x in (on_device, of_processor))
        pairs = zip(found, expected, strict=True) if isinstance(found, tuple) else [(found, expected)]
        assert all(x.tobytes() == y.tobytes() for x, y in pairs), quantity
    assert pickle.loads(pickle.dumps(on_device)).arm == arm
