"""Diagnostics as SARIF 2.1.0, the form that code hosts and editors read."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

from armwright.program.diagnostics.index import find_page
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source, Span
from armwright.version import __version__


def to_sarif(programs: Sequence[tuple[Sequence[Diagnostic], Source, str]]) -> dict[str, Any]:
    """Return the diagnostics of programs as one SARIF log.

    Args:
        programs: of each the diagnostics, the text, and the path as it shall stand in the log.
    """
    codes = sorted({diagnostic.code for diagnostics, _, _ in programs for diagnostic in diagnostics})
    results = [_result(one, source, path, codes) for diagnostics, source, path in programs for one in diagnostics]
    driver = {"name": "armwright", "version": __version__, "rules": [_rule(code) for code in codes]}
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [run]}


def _rule(code: str) -> dict[str, Any]:
    page = find_page(code)
    return {"id": code, "shortDescription": {"text": page.title}, "fullDescription": {"text": page.text}}


def _result(diagnostic: Diagnostic, source: Source, path: str, codes: list[str]) -> dict[str, Any]:
    uri = _uri(path, source, diagnostic.span)
    advice = "".join(f"\n{head}: {text}" for head, text in diagnostic.remarks)
    result: dict[str, Any] = {
        "ruleId": diagnostic.code,
        "ruleIndex": codes.index(diagnostic.code),
        "level": diagnostic.severity.value,
        "message": {"text": diagnostic.message + advice},
        "locations": [_location(diagnostic.span, source, path, diagnostic.label)],
    }
    if diagnostic.secondary:
        result["relatedLocations"] = [
            {"id": number, **_location(label.span, source, path, label.text)}
            for number, label in enumerate(diagnostic.secondary, 1)
        ]
    if diagnostic.fixes:
        replacements = [
            {"deletedRegion": _region(fix.span, source), "insertedContent": {"text": fix.replacement}}
            for fix in diagnostic.fixes
        ]
        change = {"artifactLocation": {"uri": uri}, "replacements": replacements}
        words = diagnostic.helps[0] if diagnostic.helps else diagnostic.message
        result["fixes"] = [{"description": {"text": words}, "artifactChanges": [change]}]
    return result


def _uri(path: str, source: Source, span: Span) -> str:
    """Return the file that a place is in: the program, or a module beside it."""
    file = source.file_number(span.start)
    return (PurePath(path).parent / source.modules[file - 1].path if file else PurePath(path)).as_posix()


def _location(span: Span, source: Source, path: str, text: str) -> dict[str, Any]:
    physical = {"artifactLocation": {"uri": _uri(path, source, span)}, "region": _region(span, source)}
    return {"physicalLocation": physical, **({"message": {"text": text}} if text else {})}


def _region(span: Span, source: Source) -> dict[str, int]:
    return {
        "startLine": source.line(span.start),
        "startColumn": source.column(span.start),
        "endLine": source.line(span.end),
        "endColumn": source.column(span.end),
        "charOffset": span.start - source.file_start(span.start),
        "charLength": span.end - span.start,
    }
