"""Pages of the site that come of the code, and links that lead out of ``docs/``; MkDocs calls this as its hook."""

import posixpath
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from inspect import ismodule
from pathlib import Path
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from typer.cli import get_docs_for_click

import armwright
import armwright.program
from armwright.cli.app import app
from armwright.report.page import run_page
from armwright.report.run_data import run_page_data

HERE = Path(__file__).parent
ROOT = HERE.parent
PACKAGE = ROOT / "src" / "armwright"
# Pages outside of docs/ that the site has too, under the same names.
OUTSIDE = ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "benchmarks/results.md")
# The page of a run that the first page of the site has in it: alone, and as it is in the frame there.
LIVE, FRAMED = "live/hand-over.html", "live/hand-over-framed.html"
LIVE_RUN = ("examples/hand_over.rlo", "examples/hand_over_cell.toml")
# In the frame it begins with the view; what is above that on the page alone is left out.
FRAMED_STYLE = "<style>header, .headline { display: none }</style>\n</head>"
# The commands have a page of their own.
NO_API = ("__main__", "cli", "version")


def house() -> list[str]:
    """Return the folders and modules of the package in the order in which imports point down."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [name for layer in layers for name in re.split(r"\s*\|\s*", layer) if name not in NO_API]


def folders(name: str) -> list[Path]:
    """Return a folder of the house and the folders in it that hold modules."""
    top = PACKAGE / name
    return [top, *sorted({path.parent for path in top.rglob("*.py") if path.parent != top})]


def modules(folder: Path) -> Iterator[str]:
    """Give the modules that stand in a folder, by their dotted names."""
    package = ".".join(folder.relative_to(PACKAGE.parent).parts)
    for path in sorted(folder.glob("*.py")):
        if path.stem != "__init__":
            yield f"{package}.{path.stem}"
        elif "\n\n" in path.read_text(encoding="utf-8").strip():
            yield package


def api_page(folder: Path) -> str:
    """Return the page of a folder: what it is about, then its modules with all that is public in them."""
    first = (folder / "__init__.py").read_text(encoding="utf-8").split('"""')[1]
    name = ".".join(folder.relative_to(PACKAGE).parts)
    lines = [f"# {name}\n", first.partition("\n")[0], ""]
    for module in modules(folder):
        lines += [f"## {module.removeprefix('armwright.')}\n", f"::: {module}\n"]
    return "\n".join(lines)


def public_page() -> str:
    """Return the page of what can be had from the package and its namespaces."""
    lines = ["# armwright\n", armwright.__doc__ or ""]
    namespaces = [armwright, *(thing for name in armwright.__all__ if ismodule(thing := getattr(armwright, name)))]
    for namespace in namespaces:
        lines += [
            f"\n## {namespace.__name__}\n",
            namespace.__doc__ or "" if namespace is not armwright else "",
            "\n| Name | What |\n|---|---|",
        ]
        for name in getattr(namespace, "__all__", []):
            thing = getattr(namespace, name)
            if not name.startswith("_") and not ismodule(thing):
                lines.append(_public_row(name, thing))
    for module in house():
        if (PACKAGE / f"{module}.py").exists():
            lines += [f"\n## {module}\n", f"::: armwright.{module}\n"]
    return "\n".join(lines)


def _public_row(name: str, thing: Any) -> str:
    """Return the row of a function or class with its first line, or of a constant with its value."""
    if not hasattr(thing, "__qualname__"):
        return f"| `{name}` | `{thing!r}` |"
    what = (thing.__doc__ or "").strip().partition("\n")[0].replace("|", "\\|")
    return f"| [`{name}`][{thing.__module__}.{thing.__qualname__}] | {what} |"


def api_pages() -> dict[str, str]:
    """Return the pages of the reference by their places, in the order of the house."""
    pages = {"api/armwright.md": public_page()}
    for name in house():
        if (PACKAGE / name).is_dir():
            for folder in folders(name):
                pages[f"api/{'.'.join(folder.relative_to(PACKAGE).parts)}.md"] = api_page(folder)
    return pages


def commands_page() -> str:
    """Return the page of all commands with their options, as ``--help`` has them."""
    command = typer.main.get_command(app)
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="armwright", title="Commands")
    return text.replace("\n**Usage**:\n\n```console\n$ armwright [OPTIONS] COMMAND [ARGS]...\n```\n", "", 1)


@cache
def live_page() -> str:
    """Return the page of a run, as the command writes it."""
    program, cell = LIVE_RUN
    recording = armwright.program.run(ROOT / program, cell=ROOT / cell)
    command = f"armwright run {program} --cell {cell} -o out"
    return run_page(run_page_data(recording, (), command))


def live_frame(place: str) -> str:
    """Return what a page of the site shows the page of a run in, with a link to it alone."""
    alone, framed = (posixpath.relpath(name, posixpath.dirname(place) or ".") for name in (LIVE, FRAMED))
    title = "The page of a run: two arms hand over a part, which can be played"
    frame = f'<iframe class="run" src="{framed}" title="{title}" loading="lazy"></iframe>'
    command = f"armwright run {LIVE_RUN[0]} --cell {LIVE_RUN[1]} -o out"
    return f"{frame}\n\n`{command}` writes this page. [Open it alone]({alone})"


def with_live_page(text: str, place: str) -> str:
    """Return the text of a page with the page of a run instead of its picture, which readers of the files see."""
    return re.sub(r"<!-- live -->\n!\[[^\]]*\]\([^)]*\)", lambda _: live_frame(place), text)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Fill the parts of the navigation that come of the folders."""
    assert config.nav is not None  # noqa: S101 - mkdocs.yml has one
    for entry in config.nav:
        if "API reference" in entry:
            entry["API reference"] = _api_nav()
        if "Decisions" in entry:
            entry["Decisions"] = ["decisions/README.md", *_decisions()]
    return config


def _decisions() -> list[str]:
    return [f"decisions/{path.name}" for path in sorted((HERE / "decisions").glob("0*.md"))]


def _api_nav() -> list[Any]:
    nav: list[Any] = ["api/armwright.md"]
    for name in house():
        if (PACKAGE / name).is_dir():
            top, *inner = [".".join(folder.relative_to(PACKAGE).parts) for folder in folders(name)]
            pages: list[Any] = [f"api/{top}.md", *({one.partition(".")[2]: f"api/{one}.md"} for one in inner)]
            nav.append({top: pages if inner else pages[0]})
    return nav


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is made, and what lies outside of ``docs/``."""
    for place, text in {**api_pages(), "commands.md": commands_page()}.items():
        files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, LIVE, content=live_page()))
    files.append(File.generated(config, FRAMED, content=live_page().replace("</head>", FRAMED_STYLE, 1)))
    for name in OUTSIDE:
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    for path in sorted((ROOT / "out" / "gallery").glob("*/report.html")):
        files.append(File.generated(config, f"gallery/{path.parent.name}.html", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links that lead out of ``docs/``, or into it, to where the site has what they name."""
    del config
    place = page.file.src_uri
    # Where the page lies beside the others when one looks at the files, not at the site.
    lies = place if place in OUTSIDE else f"docs/{place}"

    def turned(found: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(lies), found[1]))
        inside = target.removeprefix("docs/")
        if inside == target and files.get_file_from_path(target) is None:
            return found[0]
        return f"]({posixpath.relpath(inside, posixpath.dirname(place) or '.')}{found[2]})"

    text = re.sub(r"\]\(([^)#:\s]+)(#[^)\s]*|)\)", turned, markdown)
    text = with_live_page(text, place)
    if place == "gallery.md":
        text = re.sub(r"<!-- page (\S+) -->", lambda found: _page_link(found[1], files), text)
    return text


def _page_link(name: str, files: Files) -> str:
    return f"[Open the page](gallery/{name}.html)" if files.get_file_from_path(f"gallery/{name}.html") else ""
