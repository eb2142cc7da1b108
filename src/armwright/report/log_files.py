"""The files of a log beside the other results of a command."""

from __future__ import annotations

from typing import Literal, TypeAlias

from armwright.extras import require_extra
from armwright.files.output import Content
from armwright.report.log_content import LogContent

# The formats of logs: MCAP with the schemas of Foxglove, and bags of ROS 2.
LogFormat: TypeAlias = Literal["mcap", "ros2"]
_MODULES = {"mcap": "mcap", "ros2": "rosbags"}


def require_log_library(kind: LogFormat) -> None:
    """Refuse to go on where what writes a log is not installed.

    Raises:
        MissingExtraError: it is not.
    """
    require_extra(_MODULES[kind], f"a log in the format '{kind}'", "logs")


def log_files(kind: LogFormat, content: LogContent) -> dict[str, Content]:
    """Return the files of a log by name: ``log.mcap``, or ``metadata.yaml`` and ``bag.mcap`` of a bag.

    Raises:
        MissingExtraError: what writes them is not installed.
    """
    if kind == "mcap":
        from armwright.report.foxglove_log import mcap_log  # noqa: PLC0415 - of one format

        return {"log.mcap": mcap_log(content)}
    from armwright.report.ros2_log import ros2_bag  # noqa: PLC0415 - of the other

    return dict(ros2_bag(content))
