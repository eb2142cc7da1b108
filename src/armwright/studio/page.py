"""The page of a studio: one HTML file with its style, its scripts and what it shows first."""

from __future__ import annotations

import html
import re
from string import Template
from typing import Any

import numpy as np

from armwright.program.language_server.highlight import (
    CONTEXT_PATTERNS,
    DECLARATIONS,
    KEYWORDS,
    OPERATORS,
    RESERVED_WORDS,
    TYPES,
)
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.report.animation import Animation, FrameTrack, MovedPart
from armwright.report.arm_figure import arm_figure
from armwright.report.markup import asset, json_text, page_head
from armwright.report.run_scene import fixture_bodies, placed_arms
from armwright.report.shape_table import ShapeTable
from armwright.report.stick_figure import arm_record
from armwright.spatial.poses import to_noap
from armwright.studio.workbench import Workbench
from armwright.version import __version__

# A comment of a style; in scripts they are lines, or stand behind a statement.
_BLOCK_COMMENT = re.compile(r"^[ ]*/\*.*?\*/$", re.DOTALL | re.MULTILINE)
_LINE_COMMENT = re.compile(r"(^|;) *// .*$", re.MULTILINE)
# Blanks that mean nothing in a style: around what ends a rule or a declaration, and behind a colon or a comma.
# Blanks that mean nothing, in lines of a script that have no text in them.
_SCRIPT_BLANKS = re.compile(r" *([=<>&|?:,;{}()\[\]]) *")
_WITH_TEXT = re.compile(r"""["'`/#]""")
_STYLE_BLANKS = re.compile(r"\s*([{};])\s*|([:,])\s+")
# Of the pages of results, and then those of the studio.
_SHARED_SCRIPTS = (
    "basics.js",
    "scene.js",
    "poses.js",
    "camera.js",
    "meshes.js",
    "surface.js",
    "gl.js",
    "labels.js",
    "view.js",
)
_SCRIPTS = (
    "live.js",
    "overlays.js",
    "gizmo.js",
    "pendant.js",
    "teaching.js",
    "editor.js",
    "modules.js",
    "assistance.js",
    "running.js",
    "charts_live.js",
    "cell_panel.js",
    "comparing.js",
    "studio.js",
)


def studio_page(workbench: Workbench, token: str, policy: str) -> str:
    """Return the page.

    Args:
        workbench: what it shows.
        token: with which it connects to its server.
        policy: what the page may do, as of Content-Security-Policy.
    """
    script = _without_blanks(_without_comments("\n".join([*map(asset, _SHARED_SCRIPTS), *map(_asset, _SCRIPTS)])))
    styles = "\n".join([*map(asset, ("page.css", "film.css", "view.css")), _asset("studio.css")])
    style = _STYLE_BLANKS.sub(r"\1\2", _without_comments(styles))
    return Template(_without_comments(_asset("studio.html"))).substitute(
        head=page_head(f"{workbench.cell.name} - armwright studio", policy, style),
        name=html.escape(workbench.cell.name),
        data=json_text({**_shown_first(workbench), "token": token}),
        script=script,
    )


def _asset(name: str) -> str:
    return asset(name, "armwright.studio")


def _without_comments(script: str) -> str:
    """Return a script, a style or a page without comments and blanks before lines, a seventh of it."""
    lines = map(str.strip, _LINE_COMMENT.sub(r"\1", _BLOCK_COMMENT.sub("", script)).splitlines())
    return "\n".join(filter(None, lines))


def _without_blanks(script: str) -> str:
    """Return a script without blanks around signs, where no text can have them."""
    lines = script.splitlines()
    return "\n".join(line if _WITH_TEXT.search(line) else _SCRIPT_BLANKS.sub(r"\1", line) for line in lines)


def _shown_first(workbench: Workbench) -> dict[str, Any]:
    cell, shapes, now = workbench.cell, ShapeTable(), np.zeros(1)
    placed = placed_arms(cell)
    figures = {
        name: arm_figure(name, placed[name], arm.q[None], np.ones(1), shapes) for name, arm in workbench.arms.items()
    }
    parts = [
        MovedPart(name=name, shape=shapes.number(part.shape), times=[0.0], arms=[None], poses=[to_noap(part.pose)])
        for name, part in cell.parts.items()
    ]
    frames = [FrameTrack(name=name, poses=to_noap(X)[None]) for name, X in workbench.frame_poses().items()]
    fixtures = fixture_bodies(cell, shapes)
    animation = Animation(
        fps=60.0,
        t=now,
        arms=figures,
        frames=frames,
        fixtures=fixtures,
        parts=parts,
        shapes=shapes.as_data(),
        contact_plane=cell.contact.height,
    )
    rest = {name: np.zeros((1, len(arm.q))) for name, arm in workbench.arms.items()}
    still = {name: (now, arm.q[None], rest[name], rest[name], rest[name]) for name, arm in workbench.arms.items()}
    return {
        "duration": 0,
        "stages": [],
        "effects": [],
        "arms": [arm_record(name, cell.arms[name].arm, still[name], cell.arms[name].base) for name in cell.arms],
        "animation": animation,
        "cameras": list(cell.cameras),
        "version": __version__,
        "words": {
            "declaration": sorted(DECLARATIONS),
            "type": sorted(TYPES),
            "keyword": sorted(KEYWORDS | OPERATORS),
            "function": sorted(FUNCTIONS),
        },
        # The page knows the reserved words, which are most of these patterns.
        "context": [(kind, pattern.replace(RESERVED_WORDS, "RESERVED")) for kind, pattern in CONTEXT_PATTERNS],
    }
