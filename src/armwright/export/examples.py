"""Trying out the programs of the pages of diagnostics, those that are exported after they have run among them."""

import re
from typing import get_args

from armwright.errors import one_of
from armwright.export.api import export_compiled, export_run
from armwright.export.refusals import ExportError
from armwright.export.targets import Target
from armwright.program.diagnostics.examples import run_example
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source

_EXPORT = re.compile(r"^// export (\w+)( program)?$", re.MULTILINE)


def diagnose_example(source: Source) -> tuple[Diagnostic, ...]:
    """Return what is said of a program: by the translator, while it runs, and when it is exported.

    Args:
        source: the program, with its comments.
    """
    diagnostics, compiled, recording = run_example(source)
    target = _EXPORT.search(source.text)
    if target is None or recording is None:
        return diagnostics
    known: dict[str, Target] = {name: name for name in get_args(Target)}
    try:
        name = known[one_of("target", target[1], known)]
        if target[2]:
            export_compiled(name, compiled, recording, "example")
        else:
            export_run(name, recording, "example")
    except ExportError as error:
        return (*diagnostics, error.diagnostic)
    return diagnostics
