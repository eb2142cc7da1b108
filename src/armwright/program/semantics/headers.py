"""The declarations in front of BEGIN: variables with their types, units, imports, and the heads of procedures."""

import math
from collections.abc import Mapping

import attrs

from armwright.errors import ArmwrightError, closest
from armwright.program.language.diagnostic import did_you_mean, labels
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_module
from armwright.program.language.units import DECLARABLE, UNITS, UnitSystem, dimension
from armwright.program.language.words import VOCABULARIES
from armwright.program.semantics.arguments import Arguments, argument_values
from armwright.program.semantics.builtins import FIRST_FUNCTIONS, WITH_NAME
from armwright.program.semantics.cell_symbols import STATION, WORLD, ImportedFrames, ReadImport
from armwright.program.semantics.expression_types import KIND_OF_TYPE, ExpressionType
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import FRAME, PREDECLARED, ProcedureSymbols, SymbolTable
from armwright.program.semantics.type_check import infer_type
from armwright.program.syntax import tree
from armwright.program.syntax.token_stream import either

# More elements than this are a slip, and would take the memory of the machine.
MAX_ELEMENTS = 1_000_000
# How people call units, whose names in a program are shorter.
_UNIT_NAMES: Mapping[str, str] = {
    **dict.fromkeys(("MILLIMETRE", "MILLIMETRES", "MILLIMETER", "MILLIMETERS"), "MM"),
    **dict.fromkeys(("CENTIMETRE", "CENTIMETRES", "CENTIMETER", "CENTIMETERS"), "CM"),
    **dict.fromkeys(("METRE", "METRES", "METER", "METERS"), "M"),
    **dict.fromkeys(("INCH", "INCHES"), "IN"),
    **dict.fromkeys(("DEGREE", "DEGREES"), "DEG"),
    **dict.fromkeys(("RADIAN", "RADIANS"), "RAD"),
}


def declare(
    names: NameResolver, program: tree.Program, read_import: ReadImport | None, arguments: Arguments
) -> list[ProcedureSymbols]:
    """Take up all that the headers declare, wherever they stand among each other.

    Returns:
        The procedures in the order of the text, those whose names are taken among them.
    """
    _declare_units(names, program)
    for header in program.headers:
        if isinstance(header, tree.Record):
            # Those of programs have been laid out.
            text = "only the file of a program has records"
            names.report("E260", text, header.span, "no record here", advice="write a program in a file of its own")
        if isinstance(header, tree.Import):
            _declare_import(names, header, read_import)
    for declaration in program.declarations:
        _declare_variables(names, names.symbols, declaration)
    for constant in program.constants:
        _declare_constant(names, constant)
    constants = {node.name.key: node for node in program.constants}
    names.symbols.arguments = argument_values(arguments, constants, names.symbols.types)
    return [_declare_procedure(names, node) for node in program.procedures]


# ---- variables -----------------------------------------------------------------------------------------------------


def _declare_variables(names: NameResolver, table: SymbolTable, declaration: tree.Declaration) -> None:
    """Take up the names of one declaration."""
    kind = _declared_type(names, declaration.type)
    for name in declaration.names:
        if name.key in table.declared:
            _report_duplicate(names, name, table.declared[name.key])
        elif name.key == WORLD or (name.key in PREDECLARED and not _is_frame(declaration.type)):
            note = "the station may be declared again as a FRAME" if name.key == STATION else ""
            text = f"`{name.text}` is predeclared as a FRAME"
            names.report("E203", text, name.span, "declared again here", note=note)
        elif table is names.symbols and name.key in names.symbols.imported and not _is_frame(declaration.type):
            text = f"`{name.text}` is a FRAME that an IMPORT brings"
            names.report("E203", text, name.span, "declared as something else here")
        else:
            table.declared[name.key] = name
            table.types[name.key] = kind


def _is_frame(written: tree.TypeName) -> bool:
    """Whether a type is, or may have been meant as, a single FRAME."""
    return written.key in (VariableKind.FRAME, None) and not written.sizes


def _report_duplicate(names: NameResolver, name: tree.Name, first: tree.Name) -> None:
    here = labels(first.span, "first declared here")
    names.report("E203", f"`{name.text}` is declared twice", name.span, "again here", secondary=here)


def _declared_type(names: NameResolver, written: tree.TypeName) -> VariableType | None:
    """Return what a declaration declares; None where something was wrong with it."""
    if written.record is not None:
        # What is left of these when records have been laid out is none.
        types = VOCABULARIES[names.symbols.std].types
        near, text = closest(written.record.text, types), f"unknown type `{written.record.text}`"
        label = f"expected {either(types)}"
        names.report("E205", text, written.record.span, label, advice=did_you_mean(near))
        written = attrs.evolve(written, key=near, record=None)
    sizes = [_array_size(names, number) for number in written.sizes]
    if written.key is None or None in sizes:
        return None
    known = tuple(size for size in sizes if size is not None)
    count = math.prod(known)
    if count > MAX_ELEMENTS:
        span = written.sizes[0].span.to(written.sizes[-1].span)
        names.report("E222", f"an array of {count} elements is too large", span, f"more than {MAX_ELEMENTS}")
        return None
    return VariableType(VariableKind(written.key), known)


def _array_size(names: NameResolver, number: tree.Number) -> int | None:
    if number.unit is not None:
        text = f"the size of an array has no unit, but `{number.text}` has"
        names.report("E224", text, number.span, "leave the unit out")
        return None
    if number.value >= 1 and number.value.is_integer():
        return int(number.value)
    # A number that was reported before is NaN.
    if not math.isnan(number.value):
        text = f"the size of an array must be an integer from 1, not {number.text}"
        names.report("E222", text, number.span, "no size")
    return None


# ---- constants -----------------------------------------------------------------------------------------------------


def _declare_constant(names: NameResolver, node: tree.Constant) -> None:
    """Take up a constant: its type is that of its value, which is made of numbers and constants in front of it."""
    name, kind, symbols = node.name, _constant_type(names, node), names.symbols
    if name.key in symbols.declared:
        _report_duplicate(names, name, symbols.declared[name.key])
    elif name.key in symbols.types:
        where = "an IMPORT brings" if name.key in symbols.imported else "is predeclared"
        names.report("E203", f"`{name.text}` is a FRAME that {where}", name.span, "a constant of the same name")
    else:
        symbols.declared[name.key], symbols.types[name.key] = name, kind
        symbols.constants.add(name.key)


def _constant_type(names: NameResolver, node: tree.Constant) -> VariableType | None:
    """Return what a constant holds; None where something is wrong with its value."""
    for part in tree.walk(node.value):
        varies = isinstance(part, tree.ArmName) or (isinstance(part, tree.Function) and part.name.key in WITH_NAME)
        if isinstance(part, tree.Name) and names.scope.type(part.key) is not None:
            varies = not names.scope.is_constant(part.key)
        if varies or (
            isinstance(part, tree.Name) and part.key in ("TIME", "MESSAGE") and names.scope.is_value(part.key)
        ):
            text, note = "the value of a constant is known before the program runs", "it may use numbers, constants"
            note += " that are declared before it, and functions of them"
            names.report("E217", text, part.span, "this is not", note=note)
            return None
    actual = infer_type(names, node.value)
    if actual is None:
        return None
    kind = VariableKind.TRANS if actual is ExpressionType.MATRIX else KIND_OF_TYPE.get(actual)
    return None if kind is None else VariableType(kind)


# ---- units ---------------------------------------------------------------------------------------------------------


def _declare_units(names: NameResolver, program: tree.Program) -> None:
    """Read the UNITS lines; each dimension is settled once."""
    first: dict[str, tree.Name] = {}
    for header in program.headers:
        for unit in header.units if isinstance(header, tree.Units) else ():
            if unit.key not in DECLARABLE:
                _report_unknown_unit(names, unit)
            elif (earlier := first.setdefault(dimension(unit.key), unit)) is not unit:
                what, here = dimension(unit.key), labels(earlier.span, "first")
                text = f"a program has one unit of {what}, but UNITS names two"
                advice = f"leave one out; a number may carry a unit of its own where {what}s are mixed: `25{unit.text}`"
                names.report("E224", text, unit.span, "second", secondary=here, advice=advice)
    chosen = {dimension: unit.key for dimension, unit in first.items()}
    names.symbols.units = UnitSystem(length=chosen.get("length", "M"), angle=chosen.get("angle", "DEG"))


def _report_unknown_unit(names: NameResolver, unit: tree.Name) -> None:
    if unit.key in UNITS:
        what = {"time": "times are always in seconds", "force": "forces are always in newtons"}[dimension(unit.key)]
        text = f"UNITS sets the units of lengths and angles, but `{unit.text}` is a unit of {dimension(unit.key)}"
        names.report("E224", text, unit.span, "leave this out", note=what)
        return
    near = _UNIT_NAMES.get(unit.key) or names.closest_name(unit.text, lambda: DECLARABLE)
    note = f"units are {', '.join(DECLARABLE)}"
    names.report("E224", f"unknown unit `{unit.text}`", unit.span, "unknown unit", note=note, advice=did_you_mean(near))


# ---- imports -------------------------------------------------------------------------------------------------------


def _declare_import(names: NameResolver, header: tree.Import, read_import: ReadImport | None) -> None:
    path = header.path
    if is_module(path.value):
        names.symbols.open_import = True
        text = f"`{path.value}` is a module, and only the file of a program can import it"
        names.report("E228", text, path.span, "not read", advice="write a program in a file of its own")
        return
    if header.alias is not None:
        text = f"`{path.value}` is no module, and its frames have their own names"
        names.report("E250", text, header.alias.span, "no name is needed", advice="leave AS and the name out")
    if read_import is None:
        names.symbols.open_import = True
        note = "a name that is not declared may be one of them"
        message = f"the frames of `{path.value}` are unknown: the file was not read"
        names.report("W205", message, header.span, "not read", note=note)
        return
    try:
        brought = read_import(path.value)
        assert isinstance(brought, ImportedFrames)  # noqa: S101 - it is no module
    except ArmwrightError as error:
        # What the file would have brought is unknown, so nothing is asked of unknown names.
        names.symbols.open_import = True
        names.report("E228", f"`{path.value}` cannot be imported", path.span, "not read", note=str(error))
        return
    names.imports.append(brought)
    for frame in brought.frames:
        if frame in PREDECLARED:
            continue
        if frame in names.symbols.imported:
            text = f"frame `{frame}` comes from two imports"
            names.report("E228", text, path.span, "it comes from here too")
        names.symbols.imported.add(frame)
        names.symbols.types[frame] = FRAME


# ---- procedures ----------------------------------------------------------------------------------------------------


def _declare_procedure(names: NameResolver, node: tree.Procedure) -> ProcedureSymbols:
    """Take up a procedure and its own names; where its name is taken it cannot be called, but is checked."""
    name = node.name
    parameters = tuple(parameter.key for declaration in node.parameters for parameter in declaration.names)
    inout = frozenset(name.key for part in node.parameters if part.mode == "INOUT" for name in part.names)
    result = None if node.result is None else _declared_type(names, node.result)
    procedure = ProcedureSymbols(node=node, parameters=parameters, inout=inout, result=result)
    for declaration in (*node.parameters, *node.declarations):
        _declare_variables(names, procedure, declaration)
    first = names.symbols.procedures.get(name.key)
    variable = names.symbols.declared.get(name.key)
    if first is not None or variable is not None:
        _report_duplicate(names, name, variable or first.node.name)  # type: ignore[union-attr]
    elif name.key in names.symbols.types:
        where = "an IMPORT brings" if name.key in names.symbols.imported else "is predeclared"
        names.report("E203", f"`{name.text}` is a FRAME that {where}", name.span, "a procedure of the same name")
    elif name.key in FIRST_FUNCTIONS:
        text = f"`{name.text}` is a function of the language"
        names.report("E203", text, name.span, "a procedure of the same name")
    else:
        names.symbols.procedures[name.key] = procedure
    return procedure
