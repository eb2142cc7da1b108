"""A session as a program: its declarations first, then its statements, in the order in which they were entered."""

from collections.abc import Callable, Iterator, Sequence

from armwright.program.formatter.format import formatted
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.syntax import tree


def program_text(
    source: Source,
    headers: Sequence[tree.Header],
    statements: Sequence[tree.Statement],
    std: Standard,
    *,
    remark: str = "",
    import_path: Callable[[str], str] = str,
) -> str:
    """Return a program that declares and does what a session has.

    Args:
        source: all that was entered.
        headers: of the session.
        statements: that were done.
        std: the language.
        remark: for the first line, if any.
        import_path: how the program shall name a file that the session has imported.
    """
    rows = [f"// {' '.join(remark.split())}"] if remark else []
    units = [unit.text for header in headers if isinstance(header, tree.Units) for unit in header.units]
    rows += [f"UNITS {', '.join(units)} ;"] if units else []
    rows += [f'IMPORT "{import_path(header.path.value)}" ;' for header in headers if isinstance(header, tree.Import)]
    variables = [header for header in headers if isinstance(header, tree.Declaration)]
    rows += [
        ("VAR " if variable is variables[0] else "    ") + declaration_text(variable) + " ;" for variable in variables
    ]
    rows += [f"CONST {source_text(source, header)} ;" for header in headers if isinstance(header, tree.Constant)]
    rows += [f"{source_text(source, header)} ;" for header in headers if isinstance(header, tree.Procedure)]
    rows += ["BEGIN", *(f"{source_text(source, statement)} ;" for statement in statements), "END.", ""]
    return formatted(Source(source.name, "\n".join(rows)), std=std)


def declaration_text(node: tree.Declaration) -> str:
    """Return a declaration with the names that it has now."""
    kind = str(node.type.key)
    if node.type.sizes:
        kind = f"ARRAY [{', '.join(size.text for size in node.type.sizes)}] OF {kind}"
    return f"{', '.join(name.text for name in node.names)} : {kind}"


def header_title(source: Source, node: tree.Header) -> str:
    """Return a header in short."""
    if isinstance(node, tree.Declaration):
        return f"VAR {declaration_text(node)}"
    if isinstance(node, tree.Constant):
        return f"CONST {' '.join(source.slice(node.span).split())}"
    return " ".join(source.slice(node.head if isinstance(node, tree.Procedure) else node.span).split())


def source_text(source: Source, node: tree.Procedure | tree.Constant | tree.Statement) -> str:
    """Return a part of a session as it was entered, with the names that it uses now."""
    pieces, end_of_copied = [], node.span.start
    for start, end, text in sorted(_name_changes(source, node)):
        pieces += [source.text[end_of_copied:start], text]
        end_of_copied = end
    pieces.append(source.text[end_of_copied : node.span.end])
    return "".join(pieces)


def _name_changes(source: Source, node: tree.Node) -> Iterator[tuple[int, int, str]]:
    for node_ in tree.walk(node):
        if isinstance(node_, tree.Name) and source.slice(node_.span) != node_.text:
            yield node_.span.start, node_.span.end, node_.text
