"""What a report has to say beside a stage, each thing in a few letters and in a sentence."""

from collections.abc import Iterator

from armwright.program.vm.move_diagnostics import detour_course, path_text, stage_obstacle
from armwright.program.vm.recording import RunStage
from armwright.report.limit_spans import SHORT
from armwright.report.page import StageBadge


def stage_badges(run: RunStage) -> Iterator[StageBadge]:
    """Yield where a stage was stopped, its detour, how it is shaped, why it is slow, and whether its certificate holds.

    Args:
        run: the stage as it was run.
    """
    stage, where, certificate = run.stage, stage_obstacle(run), run.stage.certificate
    if run.stopped:
        title = (
            f"stopped on its path, after {run.duration:.3f} s and {run.length * 1e3:.1f} mm "
            f"of {stage.trajectory.duration:.3f} s and {stage.length * 1e3:.1f} mm"
        )
        yield StageBadge(text="stopped", title=title, mark="warn")
    if where and stage.detour is not None:
        course = f"{detour_course(stage.detour, run.arm)}: {stage.detour.price}"
        title = f"the straight line is infeasible at {where}; {course}"
        yield StageBadge(text=f"detour {stage.detour.method}", title=title, mark="warn")
    elif where:
        title = "; ".join(filter(None, (stage.slowed, f"without stops the path is infeasible at {where}")))
        yield StageBadge(text="stops at frames", title=title, mark="warn")
    if run.path is not None:
        yield StageBadge(text="planned path", title=path_text(run.path))
    if stage.shaping is not None:
        yield StageBadge(text=f"smooth {stage.shaping.added:+.2f} s", title=stage.shaping.summary)
    if certificate is not None and certificate.because is not None:
        limit, joint = certificate.because
        text = f"{SHORT[limit]} j{joint + 1}"
        yield StageBadge(text=text, title=certificate.slowed, mark="warn", factor=certificate.factor)
    elif stage.slowed and not where:
        yield StageBadge(text="slowed", title=stage.slowed, mark="warn")
    if certificate is not None:
        kept = certificate.holds
        text = "certified" if kept else "not certified"
        yield StageBadge(text=text, title=certificate.summary, mark="good" if kept else "bad")
