"""What variables are known to hold while a program is written, for languages in which poses cannot be computed."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import TypeAlias

import attrs
import numpy as np

from armwright.export.translation.code import (
    Assign,
    Choice,
    FunctionCall,
    Number,
    Operation,
    Pose,
    Procedure,
    ProgramCode,
    Return,
    Statement,
    Truth,
    Value,
    Variable,
)
from armwright.export.translation.values import Constant, worked_out
from armwright.program.language.units import UnitSystem
from armwright.program.vm.operators import EvaluationError

_Place: TypeAlias = tuple[str, tuple[int, ...]]
# Numbers of poses that are this near are the same [m, rad].
_ALIKE = 1e-9


@attrs.define(kw_only=True, eq=False)
class KnownValues:
    """What variables and elements are known to hold at a statement, on all ways that lead there.

    Attributes:
        units: of the numbers.
        functions: of the program, by key.
        held: by key and indices.
    """

    units: UnitSystem
    functions: Mapping[str, Procedure]
    held: dict[_Place, Constant]

    @classmethod
    def at_start(cls, code: ProgramCode) -> "KnownValues":
        """Return what is known where a program begins."""
        held: dict[_Place, Constant] = {}
        for one in code.declarations:
            if isinstance(one.initial, Number | Truth | Pose):
                for place in product(*(range(1, size + 1) for size in one.sizes)):
                    held[one.key, place] = one.initial
        functions = {one.key: one for one in code.procedures if one.result is not None}
        return cls(units=code.units, functions=functions, held=held)

    def copy(self) -> "KnownValues":
        """Return the same, to be changed alone."""
        return attrs.evolve(self, held={**self.held})

    def joined(self, other: "KnownValues") -> "KnownValues":
        """Return what is known on two ways."""
        same = {
            place: value
            for place, value in self.held.items()
            if place in other.held and _alike(value, other.held[place])
        }
        return attrs.evolve(self, held=same)

    def same_as(self, other: "KnownValues") -> bool:
        """Whether the same is known."""
        alike = (place in other.held and _alike(value, other.held[place]) for place, value in self.held.items())
        return len(self.held) == len(other.held) and all(alike)

    def set(self, target: Variable, value: Constant | None) -> None:
        """Take note of what a variable gets; None where that is not known."""
        place = self.place(target)
        if place is None:
            for held in [one for one in self.held if one[0] == target.key]:
                del self.held[held]
        elif value is None:
            self.held.pop(place, None)
        else:
            self.held[place] = value

    def place(self, variable: Variable) -> _Place | None:
        """Return which variable or element is meant; None where that is not known."""
        indices = [self.value(index) for index in variable.indices]
        numbers = [round(one.value) for one in indices if isinstance(one, Number)]
        return (variable.key, tuple(numbers)) if len(numbers) == len(indices) else None

    def value(self, value: Value) -> Constant | None:
        """Return what a value is; None where that is not known."""
        match value:
            case Number() | Truth() | Pose():
                return value
            case Variable():
                place = self.place(value)
                return None if place is None else self.held.get(place)
            case Operation(name, arguments):
                known = [self.value(one) for one in arguments]
                constants = [one for one in known if one is not None]
                return self._operation(name, constants) if len(constants) == len(known) else None
            case FunctionCall(procedure=key, arguments=arguments):
                function, inside = self.functions[key], self.copy()
                for (parameter, _), argument in zip(function.parameters, arguments, strict=True):
                    inside.set(Variable(parameter), self.value(argument))
                return _result(inside, function.body)
        return None

    def _operation(self, name: str, constants: list[Constant]) -> Constant | None:
        if name in ("and", "or"):
            truths = [isinstance(one, Truth) and one.value for one in constants]
            return Truth(all(truths) if name == "and" else any(truths))
        try:
            return worked_out(name, constants, self.units)
        except EvaluationError:
            return None


def _alike(first: Constant, second: Constant) -> bool:
    if isinstance(first, Pose) and isinstance(second, Pose):
        return bool(np.abs(first.X - second.X).max() <= _ALIKE)
    return not isinstance(first, Pose) and first == second


def _result(known: KnownValues, body: Sequence[Statement]) -> Constant | None:
    """Return the value of a function with this body; None where it is not known, or more is done."""
    for statement in body:
        match statement:
            case Assign(target=target, value=value):
                known.set(target, known.value(value))
            case Choice(condition=condition, then=then, otherwise=otherwise):
                chosen = known.value(condition)
                if not isinstance(chosen, Truth):
                    return None
                way = then if chosen.value else otherwise
                return _result(known, (*way, *body[body.index(statement) + 1 :]))
            case Return(value=value):
                return known.value(value)
            case _:
                return None
    return None
