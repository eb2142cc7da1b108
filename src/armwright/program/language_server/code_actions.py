"""Code actions: fixes of diagnostics at the cursor, or all certain fixes of a program."""

import re
from collections.abc import Iterable, Sequence
from itertools import chain

import attrs
from lsprotocol import types as lsp

from armwright.program.diagnostics.fixes import select_disjoint
from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.text_edits import TextEdit
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.positions import position, span_of, text_edits

# Of one's own, so that an editor may fix programs when it saves them, and nothing else.
FIX_ALL = f"{lsp.CodeActionKind.SourceFixAll.value}.armwright"
# A longer text is not repeated in a title.
_MAX_SHOWN_LENGTH = 30
_DID_YOU_MEAN = re.compile(r"did you mean `([A-Za-z][\w-]*)`")
# The span of a misspelt word is the word, or ends with it: `WITH SPED`.
_LAST_WORD = re.compile(r"(?<![\w-])[^\W\d_][\w-]*\Z")


def code_actions(
    analysis: Analysis, uri: str, range_: lsp.Range, context: lsp.CodeActionContext
) -> list[lsp.CodeAction]:
    """Return the fixes that an editor asks for: of the diagnostics in a range of text, and all certain ones.

    Args:
        analysis: of the program.
        uri: of its document.
        range_: the range of text.
        context: the kinds of fixes that are requested, and the diagnostics that the editor shows.
    """
    actions = []
    if _is_requested(lsp.CodeActionKind.QuickFix.value, context):
        actions += quick_fixes(analysis, uri, range_, context.diagnostics)
    certain = all_fixes(analysis.diagnostics)
    if certain and _is_requested(FIX_ALL, context):
        edit = _workspace_edit(analysis, uri, certain)
        actions.append(lsp.CodeAction("apply all certain fixes", kind=FIX_ALL, edit=edit))
    return actions


def _is_requested(kind: str, context: lsp.CodeActionContext) -> bool:
    """Whether an editor requests a kind of fixes, or all kinds."""
    return context.only is None or any(f"{kind}.".startswith(prefix + ".") for prefix in context.only)


def quick_fixes(
    analysis: Analysis, uri: str, range_: lsp.Range, published: Sequence[lsp.Diagnostic]
) -> list[lsp.CodeAction]:
    """Return the fixes of the diagnostics in a range of text: certain ones, and corrections of misspelt names."""
    source, span = analysis.compiled.source, span_of(analysis.codec, range_)
    actions = []
    for diagnostic in analysis.diagnostics:
        cured = _with_suggested_word(diagnostic, source)
        parts = (cured.span, *(fix.span for fix in cured.fixes)) if cured.fixes else ()
        if not any(start <= span.end and span.start <= end for start, end in parts):
            continue
        key = diagnostic.code, position(analysis.codec, diagnostic.span.start)
        shown = [other for other in published if (other.code, other.range.start) == key]
        actions.append(
            lsp.CodeAction(
                title=_title(cured, source),
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=shown[:1] or None,
                is_preferred=bool(diagnostic.fixes),
                edit=_workspace_edit(analysis, uri, _edits(cured)),
            )
        )
    return actions


def _workspace_edit(analysis: Analysis, uri: str, edits: Iterable[TextEdit]) -> lsp.WorkspaceEdit:
    return lsp.WorkspaceEdit(changes={uri: text_edits(analysis.codec, edits)})


def _with_suggested_word(diagnostic: Diagnostic, source: Source) -> Diagnostic:
    """Return a diagnostic that suggests another word with that word as its fix.

    The fix is not certain: an editor offers it, and `armwright fix` does not apply it.
    """
    word = next((match[1] for help_ in diagnostic.helps if (match := _DID_YOU_MEAN.match(help_))), None)
    if diagnostic.fixes or word is None:
        return diagnostic
    written = _LAST_WORD.search(source.slice(diagnostic.span))
    if written is None:
        return diagnostic
    start = diagnostic.span.start + written.start()
    return attrs.evolve(diagnostic, fixes=(Fix(Span(start, diagnostic.span.end), word),))


def all_fixes(diagnostics: Iterable[Diagnostic]) -> tuple[TextEdit, ...]:
    """Return all certain fixes that can be applied at once, in the order of the text; of two that touch, the first."""
    curable = select_disjoint([diagnostic for diagnostic in diagnostics if diagnostic.fixes])
    return tuple(sorted(chain.from_iterable(map(_edits, curable)), key=lambda edit: edit.span.start))


def _edits(diagnostic: Diagnostic) -> tuple[TextEdit, ...]:
    return tuple(TextEdit(fix.span, fix.replacement) for fix in diagnostic.fixes)


def _title(diagnostic: Diagnostic, source: Source) -> str:
    fix = diagnostic.fixes[0]
    old, new = source.slice(fix.span), fix.replacement
    if len(diagnostic.fixes) > 1 or len(old) > _MAX_SHOWN_LENGTH or len(new) > _MAX_SHOWN_LENGTH:
        return (diagnostic.helps or (f"correct this: {diagnostic.message}",))[0].partition("\n")[0]
    if not new.strip():
        return f"remove `{old.strip()}`"
    return f"insert `{new.strip()}`" if not old.strip() else f"replace `{old.strip()}` by `{new.strip()}`"
