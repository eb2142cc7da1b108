"""Diagnostics for editors and code hosts: SARIF."""

import json

from armwright.program import Source, compile as translate
from armwright.program.diagnostics.sarif import to_sarif
from program.shelf import BARE, CORPUS

M1 = (CORPUS / "m1.rlo").read_text(encoding="utf-8")
LEVELS = {"error", "warning", "note", "none"}


def log(text: str, path: str = "m.rlo") -> dict:
    source = Source("m.rlo", text)
    return json.loads(json.dumps(to_sarif([(translate(source, BARE).diagnostics, source, path)])))


def test_whole() -> None:
    """A log has one run of one tool, a rule for each code that was said, and a result for each diagnostic."""
    found = log(M1, "programs/m1.rlo")
    (run,) = found["runs"]

    assert found["version"] == "2.1.0"
    assert run["tool"]["driver"]["name"] == "armwright"
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == sorted({"E104", "E105", "E108", "E109", "E110"})
    assert all(rule["shortDescription"]["text"] for rule in run["tool"]["driver"]["rules"])
    assert len(run["results"]) == 6
    for result in run["results"]:
        assert rules[result["ruleIndex"]] == result["ruleId"]
        assert result["level"] in LEVELS
        (location,) = result["locations"]
        assert location["physicalLocation"]["artifactLocation"]["uri"] == "programs/m1.rlo"


def test_regions_hold_what_they_say() -> None:
    """Lines, columns and offsets of a region all give the same characters."""
    lines = M1.split("\n")
    for result in log(M1)["runs"][0]["results"]:
        places = [*result["locations"], *result.get("relatedLocations", ())]
        for region in (place["physicalLocation"]["region"] for place in places):
            by_offset = M1[region["charOffset"] : region["charOffset"] + region["charLength"]]
            assert region["startLine"] == region["endLine"]
            by_column = lines[region["startLine"] - 1][region["startColumn"] - 1 : region["endColumn"] - 1]
            assert by_offset == by_column


def test_fixes_cure() -> None:
    """Putting in what a result proposes takes its diagnostic away."""
    text = M1
    while True:
        fixes = [result["fixes"][0] for result in log(text)["runs"][0]["results"] if "fixes" in result]
        if not fixes:
            break
        for change in fixes[-1]["artifactChanges"][0]["replacements"]:
            region = change["deletedRegion"]
            start, end = region["charOffset"], region["charOffset"] + region["charLength"]
            text = text[:start] + change["insertedContent"]["text"] + text[end:]

    assert {result["ruleId"] for result in log(text)["runs"][0]["results"]} == {"E105", "E108"}


def test_nothing_to_say() -> None:
    """A program that is right gives a run without results."""
    assert log("BEGIN OPEN ARM_1 END.")["runs"][0]["results"] == []
