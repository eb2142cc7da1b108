"""The parser by hand and the one made from the grammar agree on what is a program."""

import random
import re
from pathlib import Path
from typing import get_args

import pytest
from lark import Lark, Token
from lark.exceptions import LarkError

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source
from armwright.program.language.units import DECLARABLE
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse
from program.sentences import IN_CONTEXT, Sentences, mutants
from program.shelf import ACCEPTED, CORPUS, REJECTED
from samples import Sample

RESERVED = VOCABULARIES[Standard.RLO_2].reserved
NO_NAME = re.compile(r"ARM(_[0-9]+)?", re.IGNORECASE)
# The grammar does not count how deep a program is.
SHALLOW = [path for path in (*ACCEPTED, *REJECTED) if path.parent.name != "depth"]
PROGRAMS = [*sorted(CORPUS.glob("*.rlo")), *SHALLOW]
WORDS = {
    "NAME": (
        "f",
        "part",
        "slot",
        "n",
        "t",
        "hit",
        "visions",
        "mm",
        "x",
        "stop",
        "zero",
        "force",
        "torque",
        "const",
        "module",
        "record",
        "as",
        "text",
        "boolean",
        "return",
        "inout",
        "log",
        "pulse",
        "within",
        "circularly",
        "smoothly",
        "velocity",
        "raise",
        "jam",
        "when",
        "brake",
        "resume",
        "timer",
    ),
    "DOTTED": ("grip.take", "f.g.h"),
    "NUMBER": ("0", "1", "12", "0.5", "1e3", "120mm", "2.5CM", "90deg", "3s"),
    "STRING": ('""', '"seated"', '"a; b { c"'),
    "ARM": ("ARM_1", "arm-2"),
    "VISIONS": ("VISIONS", "visions"),
    "ZERO": ("ZERO", "zero"),
    **IN_CONTEXT,
    "UNITNAME": DECLARABLE,
    "RELOP": ("<", "<=", "<>", ">=", ">"),
    "ADDOP": ("+", "-"),
    "MULOP": ("*", "/"),
    "RIGIDITY": ("RIGIDLY", "NonRigidly"),
    "ONOFF": ("ON", "off"),
    "WITHKEY": ("APPROACH", "Departure", "SPEED", "BLEND", "DURATION"),
}
SENTENCES = 400
MUTANTS_OF_EACH = 12


def reserved(token: Token) -> Token:
    """Keep the lexer, which takes words by where they stand, from taking a reserved one or an arm for a name."""
    taken = token.upper().partition(".")[0] in RESERVED or NO_NAME.fullmatch(token)
    return Token.new_borrow_pos("RESERVED", token.value, token) if taken else token


GRAMMAR = Lark(
    (CORPUS / "rlo.lark").read_text(encoding="utf-8"),
    parser="lalr",
    lexer="contextual",
    # Lark compares with the last of them only.
    lexer_callbacks={"DOTTED": reserved, "NAME": reserved},
)


def by_grammar(text: str) -> bool:
    try:
        GRAMMAR.parse(text)
    except LarkError:
        return False
    return True


def by_hand(text: str) -> tuple[bool, list[Diagnostic]]:
    """Whether the parser by hand has nothing to say, and nothing is left that the checker has to refuse."""
    source = Source("t.rlo", text)
    scanned = scan(source, text, Standard.RLO_2)
    program, slips = parse(source, scanned.tokens, Standard.RLO_2)
    # The grammar does not count the characters of names.
    said = [one for one in [*scanned.diagnostics, *slips] if one.code != "E103"]
    return not said and not any(left_to_the_checker(node) for node in tree.walk(program)), said


def left_to_the_checker(node: object) -> bool:
    """Whether the parser has let through what only the checker refuses, because it can say more about it."""
    match node:
        case tree.Open(arm=arm) | tree.ReadSystem(arm=arm) | tree.Grasp(arm=arm) | tree.ZeroForce(arm=arm):
            wrong = not isinstance(arm, tree.ArmName | None)
        case tree.Assign(target=child) | tree.Unfix(child=child):
            wrong = isinstance(child, tree.ArmName)
        case tree.ReadVisions(targets=targets):
            wrong = any(isinstance(target, tree.ArmName) for target in targets)
        case tree.Operate(device=device):
            wrong = not isinstance(device, tree.Name)
        case tree.Procedure(result=result) if result is not None:
            wrong = any(not isinstance(part, tree.FUNCTION_STATEMENTS) for part in statements_of(node.body))
        case tree.Units(units=units):
            wrong = any(unit.key not in DECLARABLE for unit in units)
        case _:
            wrong = False
    return wrong


def statements_of(body: tree.Block) -> list[tree.Node]:
    return [node for node in tree.walk(body) if isinstance(node, get_args(tree.Statement))]


def agree(text: str) -> bool:
    """Compare the two; return whether it is a program."""
    right = by_grammar(text)
    accepted, said = by_hand(text)

    assert accepted == right, f"the grammar says {right}, by hand {[one.message for one in said]}:\n{text}"
    return right


def words_of(text: str) -> list[str]:
    source = Source("t.rlo", text)
    bare, _ = blank_line_numbers(source)
    return [token.text for token in scan(source, bare, Standard.RLO_2).tokens[:-1] if not token.damaged]


def joined(words: list[str], seed: int) -> str:
    """Put words together, here and there on a new line: where lines end must not matter."""
    chance = random.Random(seed)
    return "".join(word + chance.choice("   \n") for word in words)


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
@pytest.mark.drawn(0.4)
def test_programs_of_the_shelf(path: Path) -> None:
    """Both take the same programs of the shelf for programs, and the same damaged ones."""
    words = words_of(path.read_text(encoding="utf-8"))
    agree(joined(words, 0))
    for seed, mutant in enumerate(mutants(words, MUTANTS_OF_EACH if len(words) > 1 else 0, seed=len(words))):
        agree(joined(mutant, seed))


def test_sentences() -> None:
    """Both take every sentence of the grammar for a program, and all rules of it have been tried."""
    sentences = Sentences(GRAMMAR, WORDS, seed=5)
    for seed, (words, _) in enumerate(zip(sentences, range(SENTENCES), strict=False)):
        assert agree(joined(words, seed))

    assert {rule for rules in sentences.rules.values() for rule in rules} == {*sentences.used}


def test_damaged_sentences(sample: Sample) -> None:
    """Both agree on sentences of the grammar with one slip, of which most are no programs."""
    verdicts, sentences = [], Sentences(GRAMMAR, WORDS, seed=sample.seed)
    for seed, (words, _) in enumerate(zip(sentences, range(sample.count(1000)), strict=False), sample.seed):
        verdicts += [agree(joined(mutant, seed)) for mutant in mutants(words, MUTANTS_OF_EACH // 2, seed)]
    sample.record("damaged sentences of the grammar, both parsers of one mind", len(verdicts), 0)

    assert 0.05 < sum(verdicts) / len(verdicts) < 0.5
