"""C text of an arm beside CasADi's: inverse dynamics and its derivatives, the same compiler and flags on both sides."""

from measure import microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

import ctypes
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import attrs
import casadi
import numpy as np

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Motor
from armwright.arrays import Array
from armwright.compiled.source_text import source_text

ARM = "puma560"
CALLS = 200_000
COMPILERS = {
    "gcc -O3": ["gcc", "-O3", "-march=native"],
    "gcc -O2": ["gcc", "-O2", "-march=native"],
    "clang -O3": [sys.executable, "-m", "ziglang", "cc", "-O3", "-march=native"],
}


def casadi_inverse_dynamics(arm: Arm) -> tuple[casadi.Function, casadi.Function]:
    """Return the recursion of Luh, Walker & Paul, and its derivatives, as CasADi has them of a textbook's loop."""
    q, qd, qdd = (casadi.SX.sym(name, arm.n) for name in ("q", "qd", "qdd"))
    w, w_dot, v_dot = casadi.SX.zeros(3), casadi.SX.zeros(3), casadi.SX(-arm.gravity)
    z = casadi.SX([0, 0, 1])
    links = []
    for i, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
        c, s = casadi.cos(joint.theta + q[i]), casadi.sin(joint.theta + q[i])
        ca, sa = (round(f(joint.alpha), 15) for f in (math.cos, math.sin))
        R = casadi.vertcat(
            casadi.horzcat(c, -s * ca, s * sa), casadi.horzcat(s, c * ca, -c * sa), casadi.horzcat(0, sa, ca)
        )
        p = casadi.SX([joint.a, joint.d * sa, joint.d * ca])
        w_dot = R.T @ (w_dot + z * qdd[i] + casadi.cross(w, z * qd[i]))
        w = R.T @ (w + z * qd[i])
        v_dot = R.T @ v_dot + casadi.cross(w_dot, p) + casadi.cross(w, casadi.cross(w, p))
        com = casadi.SX(link.com)
        F = link.mass * (v_dot + casadi.cross(w_dot, com) + casadi.cross(w, casadi.cross(w, com)))
        inertia = casadi.SX(link.inertia)
        N = inertia @ w_dot + casadi.cross(w, inertia @ w)
        links.append((R, p, com, F, N))
    f, n, tau = casadi.SX.zeros(3), casadi.SX.zeros(3), [casadi.SX(0)] * arm.n
    for i in reversed(range(arm.n)):
        R, p, com, F, N = links[i]
        n = n + casadi.cross(p, f) + casadi.cross(p + com, F) + N
        f = f + F
        tau[i] = casadi.dot(n, R[2, :].T)
        f, n = R @ f, R @ n
    efforts = casadi.vertcat(*tau)
    partials = [casadi.densify(casadi.jacobian(efforts, x)) for x in (q, qd)]
    return (
        casadi.Function("efforts", [q, qd, qdd], [efforts]),
        casadi.Function("partials", [q, qd, qdd], partials),
    )


_LOOP = """
#include <stddef.h>
void repeat(size_t count, const double *q, const double *qd, const double *qdd, double *out) {{
    for (size_t i = 0; i < count; i++) {{
        {call}
        __asm__ volatile("" : : "r"(out) : "memory");
    }}
}}
"""


def built(folder: Path, name: str, text: str, compiler: list[str]) -> Callable[..., None]:
    """Compile a text, and return its function that repeats a call."""
    (folder / f"{name}.c").write_text(text)
    library = folder / f"{name}.so"
    command = [*compiler, "-shared", "-fPIC", "-w", str(folder / f"{name}.c"), "-lm", "-o", str(library)]
    subprocess.run(command, check=True)
    function = ctypes.CDLL(str(library)).repeat
    function.argtypes, function.restype = [ctypes.c_size_t, *[ctypes.c_void_p] * 4], None
    return function  # type: ignore[no-any-return]


def texts(arm: Arm, what: str) -> tuple[str, str]:
    """Return the text of armwright and that of CasADi, each with a loop around its call."""
    quantity = {"efforts": "inverse_dynamics", "partials": "inverse_dynamics_derivatives"}[what]
    outputs = {"efforts": "out", "partials": "out, out + 36, out + 72"}[what]
    own = source_text(arm, [quantity], "c") + _LOOP.format(call=f"puma560_{quantity}(q, qd, qdd, {outputs});")
    function = dict(zip(("efforts", "partials"), casadi_inverse_dynamics(arm), strict=True))[what]
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("theirs", {"with_header": False})
        generator.add(function)
        generator.generate(f"{folder}/")
        text = (Path(folder) / "theirs.c").read_text()
    results = {"efforts": "out", "partials": "out, out + 36"}[what]
    work = f"static double w[{max(1, function.sz_w())}]; const double *arg[] = {{q, qd, qdd}};"
    call = f"{work} double *res[] = {{{results}}}; {what}(arg, res, 0, w, 0);"
    return own, text + _LOOP.format(call=call)


def main() -> None:
    """Measure and print."""
    arm = load_arm(ARM)
    arm = attrs.evolve(arm, motors=[Motor()] * arm.n)
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, size=(3, arm.n))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for what in ("efforts", "partials"):
            both = texts(arm, what)
            for title, compiler in COMPILERS.items():
                progress(f"{what} by {title}")
                outs = [np.zeros(108), np.zeros(108)]
                works = []
                for k, (text, out) in enumerate(zip(both, outs, strict=True)):
                    repeat = built(Path(folder), f"{what}{k}{title.replace(' ', '')}", text, compiler)
                    works.append(lambda repeat=repeat, out=out: repeat(CALLS, *addresses(q, qd, qdd, out)))
                own, theirs = (x / CALLS for x in per_call(*works, calls=1))
                size = {"efforts": 6, "partials": 72}[what]
                np.testing.assert_allclose(outs[0][:size], dense(outs[1], what)[:size], atol=1e-9)
                rows.append([what, title, microseconds(theirs), microseconds(own), f"{own / theirs:.2f}"])
    section(
        "C text of an arm",
        f"`{ARM}`, one configuration a call, {CALLS} calls; efforts, and their derivatives by positions and velocities "
        "(armwright's with the mass matrix). CasADi: the recursion in the axes of the links, `SX`, and `jacobian`.",
        table(["function", "compiler", "CasADi, µs", "armwright, µs", "armwright / CasADi"], rows),
    )


def addresses(*arrays: Array) -> list[int]:
    """Return where arrays lie."""
    return [array.ctypes.data for array in arrays]


def dense(out: Array, what: str) -> Array:
    """Return numbers in the order of armwright: CasADi writes matrices column by column."""
    return out if what == "efforts" else out[:72].reshape(2, 6, 6).swapaxes(1, 2).ravel()


if __name__ == "__main__":
    main()
