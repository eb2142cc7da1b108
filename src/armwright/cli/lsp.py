"""``armwright lsp``: the language server, for editors."""

from typing import Annotated

import typer


def lsp(
    _stdio: Annotated[
        bool, typer.Option("--stdio", help="Talk over standard input and output. There is no other way.", hidden=True)
    ] = True,
) -> None:
    """Serve an editor that speaks the Language Server Protocol, over standard input and output.

    Messages while one types, hovers with the poses of the cell, definition, references, rename, completion, fixes,
    colours by meaning, the stages behind each MOVE, outline, formatting. Settings of the editor, all under
    `armwright`: `cell` (a file; else the program's IMPORT, or the only cell beside it), `std` (`2` or `83`), `strict`.

    **Example**, in a configuration of Neovim:
    `vim.lsp.config("rlo", { cmd = { "armwright", "lsp" }, filetypes = { "rlo" } })`
    """
    import os
    import sys

    from armwright.errors import MissingExtraError

    try:
        from armwright.program.language_server.server import serve
    except ImportError as error:
        if (error.name or "").partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        text = "the language server needs pygls; install it by: pip install 'armwright[lsp]'"
        raise MissingExtraError(text) from error
    status = serve()
    sys.stderr.flush()
    # A program may still be looked at, and the input be read from, which would keep the process alive.
    os._exit(status)
