"""A small engine for TextMate grammars: as much of it as the grammar of RLO needs, with Python's regular expressions.

Editors use another dialect of regular expressions; the grammar keeps to what both read alike. A pattern sees one line
at a time, its line end included, and the earliest match wins; of several at one place the first, an end before all.
"""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, TypeAlias

Rule: TypeAlias = Mapping[str, Any]
# Text and innermost scope; a stretch that no rule names has the scope of what is around it.
Piece: TypeAlias = tuple[str, str | None]

_LINE = re.compile(r"[^\n]*\n|[^\n]+\Z")


@cache
def compiled(pattern: str, *, first_line: bool) -> re.Pattern[str]:
    """Return a pattern; the start of the text is on its first line alone."""
    return re.compile(pattern if first_line else pattern.replace(r"\A", "(?!)"))


class Engine:
    """One grammar."""

    def __init__(self, grammar: Rule) -> None:
        self._grammar = grammar

    def pieces(self, text: str) -> Iterator[Piece]:
        """Yield the pieces of a text with their scopes; together they are the text."""
        stack: list[Rule] = [self._grammar]
        for number, line in enumerate(_LINE.findall(text)):
            yield from self._line(line, stack, first_line=number == 0)

    def _line(self, line: str, stack: list[Rule], *, first_line: bool) -> Iterator[Piece]:
        at = 0
        while True:
            inside = stack[-1]
            found = self._earliest(inside, line, at, first_line=first_line)
            if found is None:
                yield line[at:], _scope(stack)
                return
            match, rule = found
            yield line[at : match.start()], _scope(stack)
            at = match.end()
            if rule is inside:
                yield from _captured(match, rule, "endCaptures", _scope(stack))
                stack.pop()
            elif "begin" in rule:
                stack.append(rule)
                yield from _captured(match, rule, "beginCaptures", _scope(stack))
            else:
                yield from _captured(match, rule, "captures", rule.get("name", _scope(stack)))
                assert match.end() > match.start(), f"a match of nothing: {rule}"

    def _earliest(self, inside: Rule, line: str, at: int, *, first_line: bool) -> tuple[re.Match[str], Rule] | None:
        patterns = [(rule, rule.get("begin") or rule["match"]) for rule in self._rules(inside)]
        if "end" in inside:
            patterns.insert(0, (inside, inside["end"]))
        found = [
            (match, rule)
            for rule, pattern in patterns
            if (match := compiled(pattern, first_line=first_line).search(line, at))
        ]
        return min(found, key=lambda pair: pair[0].start(), default=None)

    def _rules(self, rule: Rule) -> Iterator[Rule]:
        """Yield the patterns inside a rule, with what they include."""
        for inner in rule.get("patterns", ()):
            target = self._grammar["repository"][inner["include"].removeprefix("#")] if "include" in inner else inner
            if "begin" in target or "match" in target:
                yield target
            else:
                yield from self._rules(target)


def _scope(stack: list[Rule]) -> str | None:
    return next((rule["name"] for rule in reversed(stack[1:]) if "name" in rule), None)


def _captured(match: re.Match[str], rule: Rule, which: str, scope: str | None) -> Iterator[Piece]:
    """Yield a match cut into its captures, which do not lie within each other."""
    captures = {int(number): capture["name"] for number, capture in rule.get(which, {}).items()}
    at = match.start()
    for number, name in sorted(captures.items()):
        yield match.string[at : match.start(number)], scope
        yield match[number], name
        at = match.end(number)
    yield match.string[at : match.end()], scope
