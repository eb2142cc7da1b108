"""Sentences of a grammar, and what one slip makes of them."""

import random
from collections import Counter
from collections.abc import Callable, Iterator, Mapping

from lark import Lark
from lark.grammar import NonTerminal, Rule, Symbol, Terminal

# What the words of the second edition read, which no grammar has as plain words: they may be names.
IN_CONTEXT: Mapping[str, tuple[str, ...]] = {
    "BOOLEAN": ("BOOLEAN", "boolean"),
    "TEXT": ("TEXT", "text"),
    "MODULE": ("MODULE", "module"),
    "AS": ("AS", "as"),
    "RECORD": ("RECORD", "record"),
    "CONST": ("CONST", "const"),
    "FUNCTION": ("FUNCTION", "function"),
    "MODE": ("IN", "INOUT", "inout"),
    "RAISE": ("RAISE", "raise"),
    "PULSE": ("PULSE", "pulse"),
    "QUEUE": ("QUEUE", "queue"),
    "PUT": ("PUT", "put"),
    "QUEUEKEY": ("CAPACITY", "speed", "VELOCITY", "Blend"),
    "TO_WORD": ("TO", "to"),
    "FOR_WORD": ("FOR", "for"),
    "TOOLKEY": ("VELOCITY", "rotation", "Acceleration", "TRACKING", "CORRECTION", "bound", "RATE"),
    "CIRCULARLY": ("CIRCULARLY", "circularly"),
    "SMOOTHLY": ("SMOOTHLY", "smoothly"),
    "WITHIN": ("WITHIN", "within"),
    "TIMER": ("TIMER", "timer"),
    "WHEN": ("WHEN", "when"),
    "BRAKE": ("BRAKE", "brake"),
    "RESUME": ("RESUME", "resume"),
    "LOG": ("LOG", "log"),
    "RETURN": ("RETURN", "return"),
}

# A sentence that has come as deep as this takes the shortest way to its end.
DEEP = 11


class Sentences:
    """Random sentences of a grammar, in which what came seldom so far comes more often."""

    def __init__(self, grammar: Lark, words: Mapping[str, tuple[str, ...]], seed: int) -> None:
        """Take the rules from a parser, and for the terminals that are no plain word what they may read."""
        self._random = random.Random(seed)
        self._words = {one.name: words.get(one.name, (str(one.pattern.value),)) for one in grammar.terminals}
        self.rules: dict[Symbol, list[Rule]] = {}
        for rule in grammar.rules:
            self.rules.setdefault(rule.origin, []).append(rule)
        self._heights = _heights(self.rules)
        self.used: Counter[Rule] = Counter()

    def __iter__(self) -> Iterator[list[str]]:
        """Give sentence after sentence, each a list of words; every fourth is a single motion, which has many forms."""
        while True:
            for _ in range(3):
                yield [*self._sentence("start")]
            yield ["BEGIN", *self._sentence("move"), "END", "."]

    def _sentence(self, start: str) -> Iterator[str]:
        waiting: list[tuple[Symbol, int]] = [(NonTerminal(start), 0)]
        while waiting:
            symbol, depth = waiting.pop()
            if isinstance(symbol, Terminal):
                yield self._random.choice(self._words[symbol.name])
                continue
            rule = self._choice(symbol, depth)
            self.used[rule] += 1
            waiting += [(part, depth + 1) for part in reversed(rule.expansion)]

    def _choice(self, symbol: Symbol, depth: int) -> Rule:
        rules = self.rules[symbol]
        if depth > DEEP:
            lowest = min(self._heights[rule] for rule in rules)
            rules = [rule for rule in rules if self._heights[rule] == lowest]
        # Every other time what came least.
        return min(rules if self._random.random() < 0.5 else [self._random.choice(rules)], key=self.used.__getitem__)


def _heights(rules: Mapping[Symbol, list[Rule]]) -> dict[Rule, float]:
    """Return how deep the shortest sentence of each rule is."""
    heights = {rule: float("inf") for several in rules.values() for rule in several}
    of: Callable[[Symbol], float] = lambda symbol: (  # noqa: E731
        0 if isinstance(symbol, Terminal) else min(heights[rule] for rule in rules[symbol])
    )
    for _ in heights:
        for rule in heights:
            heights[rule] = 1 + max((of(symbol) for symbol in rule.expansion), default=0)
    return heights


def mutants(words: list[str], count: int, seed: int) -> Iterator[list[str]]:
    """Give sentences with one word dropped, doubled, swapped with the next, or put in the place of another."""
    chance = random.Random(seed)
    for _ in range(count):
        at = chance.randrange(len(words) - 1)
        one, two = words[at], words[at + 1]
        slips = [[], [one, one], [two, one], [chance.choice(words)]]
        slip = chance.randrange(len(slips))
        yield [*words[:at], *slips[slip], *words[at + (2 if slip == 2 else 1) :]]
