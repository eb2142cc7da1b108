"""``armwright lsp``: the language server for editors."""

from typing import Annotated

from typer import Option


def lsp(
    _stdio: Annotated[
        bool,
        Option("--stdio", help="Communicate over standard input and output, which is the only transport.", hidden=True),
    ] = True,
) -> None:
    """Serve an editor by the Language Server Protocol, over standard input and output.

    The server has diagnostics at every change, hover texts with the poses of the cell, definition, references, rename,
    completion, fixes, semantic highlighting, the stages behind each MOVE, outline and formatting. Settings of the
    editor, all under `armwright`: `cell` (a file; the default is the program's IMPORT, or the only cell in its folder),
    `std` (`2` or `83`) and `strict`.

    **Example**, in a configuration of Neovim:
    `vim.lsp.config("rlo", { cmd = { "armwright", "lsp" }, filetypes = { "rlo" } })`
    """
    import os
    import sys

    from armwright.errors import MissingExtraError

    try:
        from armwright.program.language_server.handlers import serve
    except ImportError as error:
        if (error.name or "").partition(".")[0] not in ("pygls", "lsprotocol"):
            raise
        text = "the language server needs pygls; install it by: pip install 'armwright[lsp]'"
        raise MissingExtraError(text) from error
    status = serve()
    sys.stderr.flush()
    # Threads that still analyse a program or read the input would keep the process alive.
    os._exit(status)
