"""Families of statements: whoever looks for AFFIX opens frames.py in every stage of the compiler."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import get_args

import pytest

import armwright.program
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree

FAMILIES = ("frames", "devices", "move", "queues", "control_flow", "output")
# Each stage with the name of the table in each of its families; the parser has one function for each rule.
TABLES = {"semantics": "CHECKS", "flow_analysis": "STEPS", "bytecode": "GENERATORS", "vm": "HANDLERS"}
STAGES = ("syntax", *TABLES)
STATEMENTS = set(get_args(tree.Statement))
NODES = {
    "frames": set(get_args(tree.FrameStatement)),
    "devices": set(get_args(tree.DeviceStatement)),
    "move": {tree.Move},
    "queues": set(get_args(tree.QueueStatement)),
    "control_flow": set(get_args(tree.ControlStatement)),
    "output": set(get_args(tree.OutputStatement)),
}
OPERATIONS = {
    "frames": {"AFFIX", "AFFAT", "UNFIX"},
    "devices": {"OPEN", "GRASP", "OPER", "OPSET", "PULSE", "TIMSW", "TIMSET", "READV", "READS", "ZEROF"},
    "move": {op.value for op in Op if op.value.startswith("MV")},
    "queues": {"QUEUE", "PUT", "QUEND"},
    "output": {"PRINT", "LOG"},
}


def table(stage: str, family: str) -> Mapping[object, object]:
    module = importlib.import_module(f"armwright.program.{stage}.{family}")
    found = getattr(module, TABLES[stage])
    assert isinstance(found, Mapping)
    return found


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("family", FAMILIES)
def test_every_stage_has_every_family(stage: str, family: str) -> None:
    """A family of statements has the same file name in every stage."""
    folder = Path(armwright.program.__file__).parent.joinpath(*stage.split("."))

    assert (folder / f"{family}.py").is_file()


@pytest.mark.parametrize("stage", ["semantics", "flow_analysis", "bytecode"])
@pytest.mark.parametrize("family", FAMILIES)
def test_statements_are_handled_in_their_family(stage: str, family: str) -> None:
    """A stage handles in a family the statements whose nodes that family of the tree has, and no others."""
    assert set(table(stage, family)) - {tree.Poison} == NODES[family]


@pytest.mark.parametrize("stage", ["semantics", "flow_analysis", "bytecode"])
def test_every_statement_is_handled(stage: str) -> None:
    """No stage forgets a statement."""
    handled = {kind for family in FAMILIES for kind in table(stage, family)}

    # Code is made of programs without errors, so none has what the parser could not read.
    assert handled == (STATEMENTS - {tree.Poison} if stage == "bytecode" else STATEMENTS)


def test_every_operation_is_executed_in_its_family() -> None:
    """The virtual machine executes each operation in the family of its statement; all others are control flow."""
    of_values = importlib.import_module("armwright.program.vm.expressions").HANDLERS
    executed = {family: {str(op) for op in table("vm", family)} for family in FAMILIES}

    assert {family: executed[family] for family in OPERATIONS} == OPERATIONS
    assert set().union(*executed.values()) | {str(op) for op in of_values} == {op.value for op in Op}
