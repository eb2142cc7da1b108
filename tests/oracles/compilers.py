"""Compilers of C, C++ and CUDA, and functions of texts that they have compiled."""

import ctypes
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import nvidia.cuda_nvrtc

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.source_text import Language, arm_functions, source_text
from armwright.tracing.emit_c import Function, Real
from armwright.tracing.native import processor

_ZIG = [sys.executable, "-m", "ziglang"]
# How each is called, and the ending of the files that it takes.
COMPILERS: dict[str, tuple[list[str], str]] = {
    "gcc": (["gcc", "-std=c99"], ".c"),
    "clang": ([*_ZIG, "cc", "-std=c99"], ".c"),
    "g++": (["g++", "-std=c++11"], ".cpp"),
    "clang++": ([*_ZIG, "c++", "-std=c++11"], ".cpp"),
}
_STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"]
_CORTEX_M7 = ["-target", "thumb-linux-musleabihf", "-mcpu=cortex_m7+fp_armv8d16"]
# What the device has and a processor has not. The threads of a block are contexts of one thread here, each of which
# runs until it waits for the others.
_DEVICE = """\
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <ucontext.h>
#define __global__
#define __device__
#define __forceinline__ inline
#define __launch_bounds__(threads)
#define __shared__ static
struct Three { unsigned x; };
static Three blockIdx, threadIdx;
static ucontext_t of_thread[128], of_block;
static char stacks[128][1 << 16];
static void (*work)();
static inline void __syncthreads() { swapcontext(&of_thread[threadIdx.x], &of_block); }
static inline void atomicOr(int *all, int one) { *all |= one; }
static bool ended[128];
static void begin() { work(); ended[threadIdx.x] = true; }
/* Runs a block, its threads in order or in the opposite one: a barrier that is missing shows in one of them. */
static void run_block(bool backwards)
{
    for (int t = 0; t < 128; t++) {
        getcontext(&of_thread[t]);
        of_thread[t].uc_stack.ss_sp = stacks[t];
        of_thread[t].uc_stack.ss_size = sizeof stacks[t];
        of_thread[t].uc_link = &of_block;
        makecontext(&of_thread[t], begin, 0);
        ended[t] = false;
    }
    for (int left = 128; left > 0;) {
        for (int t = 0; t < 128; t++) {
            threadIdx.x = backwards ? 127 - t : t;
            if (!ended[threadIdx.x]) {
                swapcontext(&of_block, &of_thread[threadIdx.x]);
                left -= ended[threadIdx.x];
            }
        }
    }
}
"""
# Undefined behaviour ends a program: with a message, or in clang without its library with a signal.
SANITIZED = {
    "gcc": ["-fsanitize=undefined", "-fno-sanitize-recover=all"],
    "clang": ["-fsanitize=undefined", "-fsanitize-trap=undefined"],
}
# As a processor with multiply-adds is told of them; others have them always, or never.
FMA = ["-mfma"] if processor().target.has_fma and "sse" in processor().features else []


def build(compiler: str, text: str, target: Path, *options: str) -> Path:
    """Compile a text, with all warnings as errors; a compiler that is missing is an error.

    Args:
        compiler: one of ``COMPILERS``.
        text: what is compiled.
        target: an object where it ends in .o, a library where it ends in .so, a program otherwise.
        options: for the compiler.
    """
    command, ending = COMPILERS[compiler]
    source, made = target.with_suffix(ending), target.with_suffix(".o")
    source.write_text(text, encoding="ascii")
    shared = ["-shared", "-fPIC"] if target.suffix == ".so" else []
    _run(*command, *_STRICT, *options, *shared[1:], "-c", str(source), "-o", str(made))
    if target != made:
        # ziglang would build a library of C++ of its own first, which takes a minute.
        sanitized = [option for option in options if option.startswith("-fsanitize=")]
        linker = "gcc" if ending == ".c" else "g++"
        _run(linker, *shared, *(sanitized if compiler in ("gcc", "g++") else []), str(made), "-o", str(target), "-lm")
    return target


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr


def sizes_on_cortex_m7(text: str, folder: Path) -> tuple[int, int, int]:
    """Return the bytes of code and constants, of data and of zeroed data of a text for a microcontroller."""
    build("clang", text, folder / "m7.o", *_CORTEX_M7, "-O2")
    done = subprocess.run(["size", str(folder / "m7.o")], capture_output=True, text=True, check=True)
    text_size, data, bss = map(int, done.stdout.splitlines()[1].split()[:3])
    return text_size, data, bss


def called_on_cortex_m7(text: str, folder: Path) -> set[str]:
    """Return the functions of libraries that a text calls where the compiler may not assume that there are any."""
    build("clang", text, folder / "m7.o", *_CORTEX_M7, "-O2", "-ffreestanding")
    done = subprocess.run(["nm", "-u", str(folder / "m7.o")], capture_output=True, text=True, check=True)
    return {line.split()[-1] for line in done.stdout.splitlines()}


class Compiled:
    """Quantities of an arm in another language, called for rows of arrays."""

    def __init__(
        self,
        arm: Arm,
        quantities: Sequence[str],
        folder: Path,
        *,
        compiler: str = "gcc",
        language: Language = "c",
        real: Real = "double",
    ) -> None:
        """Compile them."""
        self._real = real
        self._functions = dict(zip(quantities, arm_functions(arm, quantities, language, real), strict=True))
        text = source_text(arm, quantities, language, real)
        loops = "\n".join(_loop(each, language, real, compiler) for each in self._functions.values())
        before = _DEVICE if language == "cuda" else ""
        target = folder / f"{compiler}_{language}_{real}.so"
        build(compiler, f"{before}{text}\n{loops}", target, "-O2", *FMA)
        self._library = ctypes.CDLL(str(target))

    def __call__(self, quantity: str, *inputs: Array) -> tuple[list[Array], Array]:
        """Return the outputs (rows, width) and the statuses (rows,)."""
        function, rows = self._functions[quantity], len(inputs[0])
        numbers = np.float32 if self._real == "float" else np.float64
        arrays = [np.ascontiguousarray(x.reshape(rows, -1), dtype=numbers) for x in inputs]
        outputs = [np.empty((rows, x.width), bool if x.flag else numbers) for x in function.outputs]
        return outputs, self.into(quantity, *arrays, *outputs)

    def into(self, quantity: str, *arrays: Array) -> Array:
        """Fill the outputs, which stand behind the inputs, and return the statuses."""
        status = np.empty(len(arrays[0]), dtype=np.intc)
        pointers = [ctypes.c_void_p(x.ctypes.data) for x in (*arrays, status)]
        self._library[f"rows_{self._functions[quantity].name}"](ctypes.c_long(len(status)), *pointers)
        return status


def _loop(function: Function, language: Language, real: Real, compiler: str) -> str:
    """Return the text of a function of rows."""
    arrays = [*function.inputs, *function.outputs]
    parameters = [f"const {real} *{x.name}" for x in function.inputs]
    parameters += [f"{'unsigned char' if x.flag else real} *{x.name}" for x in function.outputs]
    head = f"void rows_{function.name}(long rows, {', '.join(parameters)}, int *status)"
    of_row = ", ".join(f"{x.name} + r * {x.width}" for x in arrays)
    if language == "cuda":
        return _blocks(function, parameters, head)
    called = function.name if language == "c" else f"armwright::{function.name}<{real}>"
    linkage = 'extern "C" ' if COMPILERS[compiler][1] == ".cpp" else ""
    return (
        f"{linkage}{head};\n{linkage}{head} {{ long r; for (r = 0; r < rows; r++) status[r] = {called}({of_row}); }}\n"
    )


def _blocks(function: Function, parameters: Sequence[str], head: str) -> str:
    """Return the text of a function of rows that runs the blocks of a kernel; it begins at odd ones backwards."""
    names = [x.name for x in (*function.inputs, *function.outputs)]
    kept = "\n".join(f"static {x.replace('*', '*g_')};" for x in parameters)
    passed = ", ".join([f"g_{name}" for name in names] + ["g_status", "g_all", "g_rows"])
    given = " ".join(f"g_{name} = {name};" for name in names)
    whole = head.replace(f"rows_{function.name}", f"all_{function.name}").replace(
        "int *status", "int *status, int *all"
    )
    return f"""\
namespace of_{function.name} {{
{kept}
static int *g_status, *g_all;
static long g_rows;
static void run() {{ {function.name}({passed}); }}
}}
extern "C" {whole}
{{
    using namespace of_{function.name};
    {given} g_status = status; g_all = all; g_rows = rows; work = run;
    for (blockIdx.x = 0; blockIdx.x * 128L < rows; blockIdx.x++) run_block(blockIdx.x % 2);
}}
extern "C" {head} {{ all_{function.name}(rows, {", ".join(names)}, status, nullptr); }}
"""


def compiled_for_device(text: str) -> str:
    """Compile kernels of CUDA for a device, and return what the compiler reports of them."""
    (library,) = Path(nvidia.cuda_nvrtc.__path__[0]).glob("lib/libnvrtc.so*")
    nvrtc = ctypes.CDLL(str(library))
    program, size = ctypes.c_void_p(), ctypes.c_size_t()
    options = [b"--gpu-architecture=sm_90", b"--fmad=false", b"--ptxas-options=-v"]
    created = nvrtc.nvrtcCreateProgram(ctypes.byref(program), text.encode(), b"kernels.cu", 0, None, None)
    assert created == 0
    status = nvrtc.nvrtcCompileProgram(program, len(options), (ctypes.c_char_p * len(options))(*options))
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    nvrtc.nvrtcDestroyProgram(ctypes.byref(program))
    assert status == 0, log.value.decode()
    return log.value.decode()
