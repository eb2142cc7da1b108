"""Quantities of an arm as text for other compilers: C, C++ and CUDA, and a program that tests it.

Of the arm's strings only the name reaches the text, as an identifier.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from inspect import getdoc
from typing import Literal, TypeAlias

from armwright.arm.model import Arm
from armwright.compiled.arm import CompiledArm
from armwright.compiled.quantities import emit_quantity
from armwright.dynamics.inertia_matrix import massless_joint
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.tracing.emit_c import Argument, Function, Real, c_header, cpp_header
from armwright.tracing.emit_cuda import cuda_source
from armwright.tracing.identifiers import identifier

Language: TypeAlias = Literal["c", "cpp", "cuda"]

# What is small there is small for double: see ``kinematics.inverse_kinematics.branches.REACH_TOLERANCE``.
_FOR_DOUBLE = frozenset({"inverse_branches"})
# What has no value where a joint moves nothing.
_FOR_MASSES = frozenset({"forward_dynamics", "forward_dynamics_derivatives"})
# From so many joints on the loops over links stay loops in the text: a controller has little room for code.
_LOOPS_FROM = 9
_ASCII = str.maketrans({"²": "^2", "³": "^3", "·": "*", "…": "...", "–": "-", "°": " deg"})


def source_text(arm: Arm, quantities: Sequence[str], language: Language, real: Real = "double") -> str:
    """Return quantities of an arm as text of a language, one function for each.

    Args:
        arm: the arm.
        quantities: names of functions of ``CompiledArm``.
        language: ``c`` for a header of C99, ``cpp`` for one of C++ templates on the type of numbers, ``cuda`` for
            kernels of which every thread does one row.
        real: the type of numbers, ``double`` or ``float``. The templates are for any.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
        InvalidValueError: a quantity occurs twice, CUDA or ``inverse_branches`` is asked for in float, or a number of
            the arm is beyond the range of float.
    """
    return text_of(arm_functions(arm, quantities, language, real), language, real)


def text_of(functions: Sequence[Function], language: Language, real: Real = "double") -> str:
    """Return functions as text of a language: see ``source_text``."""
    if language == "cpp":
        return cpp_header(functions)
    if language == "c":
        return c_header(functions, real)
    if real == "float":
        raise InvalidValueError("real: expected double for cuda, got float")
    return cuda_source(functions)


def arm_functions(arm: Arm, quantities: Sequence[str], language: Language, real: Real = "double") -> list[Function]:
    """Return what becomes functions; all names in it are identifiers.

    Args:
        arm: the arm.
        quantities: names of functions of ``CompiledArm``.
        language: of the text.
        real: the type of numbers that they are for.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
        InvalidValueError: a quantity occurs twice, or it takes more digits than float has.
    """
    for i, name in enumerate(quantities):
        if name in quantities[:i]:
            raise InvalidValueError(f"quantities: expected each once, got {name} twice")
        if real == "float" and name in _FOR_DOUBLE:
            raise InvalidValueError(
                f"real: expected double for {name}, got float, whose digits do not tell what is in reach"
            )
        if name in _FOR_MASSES and (joint := massless_joint(arm)) is not None:
            raise UnsupportedArmError(
                f"arm '{arm.name}': no {name}, for joint {joint + 1} moves no mass and has no finite acceleration; "
                f"specify mass and inertia of link {joint + 1}, or the inertia of its motor"
            )
    prefix = identifier(arm.name, otherwise="arm")
    # Both types may be included in one program of C, where functions of one name cannot differ in their arguments.
    suffix = "_float" if real == "float" and language == "c" else ""
    return [_function(arm, name, f"{prefix}_{name}{suffix}", language) for name in quantities]


def _function(arm: Arm, quantity: str, name: str, language: Language) -> Function:
    # A device computes what the kernel of the processor computes, long arms included.
    emitted = emit_quantity(arm, quantity, loops=None if language == "cuda" else arm.n >= _LOOPS_FROM)
    doc = getdoc(getattr(CompiledArm, quantity)) or ""
    arguments: list[Argument] = []
    names = [*emitted.inputs, *_output_names(doc, len(emitted.outputs))]
    for i, (of_array, shape) in enumerate(zip(names, [*emitted.inputs.values(), *emitted.outputs], strict=True)):
        unlike = identifier(of_array, [name, *(x.name for x in arguments)])
        arguments.append(Argument(unlike, math.prod(shape), flag=i - len(emitted.inputs) in emitted.flags))
    return Function(
        name=name,
        code=emitted.code,
        any_type=emitted.any_type,
        inputs=arguments[: len(emitted.inputs)],
        outputs=arguments[len(emitted.inputs) :],
        operations=emitted.operations,
        description=_description(doc, arm.n),
    )


def _output_names(doc: str, count: int) -> list[str]:
    """Return how the docstring of a quantity calls its outputs: all of them, or none."""
    names = re.findall(r"^    (\w+): ", _section(doc, "Returns"), flags=re.MULTILINE)
    return names if len(names) == count else ["out"] if count == 1 else [f"out{i}" for i in range(count)]


def _section(doc: str, name: str) -> str:
    """Return the lines of a section of a docstring."""
    match = re.search(rf"^{name}:\n((?:    .*\n?|\n)*)", doc, flags=re.MULTILINE)
    return match[1].rstrip() if match else ""


def _description(doc: str, joints: int) -> list[str]:
    """Return what a quantity is, and the shapes and units of its arrays, of its docstring."""
    inputs = re.sub(r"^    (threads|out): .*\n?(?:        .*\n?)*", "", _section(doc, "Args"), flags=re.MULTILINE)
    parts = [doc.partition("\n")[0], "", "Inputs:", inputs.rstrip(), "Outputs:", _section(doc, "Returns")]
    parts += ["", f"n is {joints}, the number of joints."]
    text = "\n".join(parts).replace("(..., ", "(").translate(_ASCII).replace("``", "").replace("*/", "* /")
    return text.encode("ascii", "replace").decode().splitlines()
