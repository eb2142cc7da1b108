"""The servos, sensors and alarms of a cell file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armwright.arm.load import is_path, load_arm
from armwright.arm.model import Arm
from armwright.cell.control import Alarms, ForceSensor, Law, Sensors, Servo
from armwright.dynamics.arguments import weighed
from armwright.errors import ArmwrightError
from armwright.files.document import Table
from armwright.files.inputs import regular_file

_LAWS: dict[str, Law] = {"computed torque": "computed torque", "pd": "pd"}
# A controller waits no longer for a reading.
_MAX_DELAY = 100


def read_servo(entry: Table) -> Servo:
    """Read the controller of an arm."""
    servo = Servo(
        bandwidth=entry.number("bandwidth_rad_per_s", default=50.0, lower=1.0, upper=1000.0),
        integral=entry.flag("integral", default=True),
        knows_parts=entry.flag("knows_parts", default=True),
        law=_LAWS[entry.choice("law", _LAWS, default="computed torque")],
    )
    entry.refuse_unknown_keys()
    return servo


def read_sensors(entry: Table) -> Sensors:
    """Read what the controller of an arm knows of its joints."""
    counts = entry.number("encoder_counts", default=0.0, lower=0.0, upper=1e12)
    if 0.0 < counts < 1.0:
        raise entry.error("encoder_counts", f"expected 1 or more, or 0 for exact positions, got {counts:g}")
    sensors = Sensors(
        counts=counts,
        effort_noise=entry.number("effort_noise_pct", default=0.0, lower=0.0, upper=100.0) * 1e-2,
        delay=entry.whole("delay_ticks", 0, _MAX_DELAY, default=0),
    )
    entry.refuse_unknown_keys()
    return sensors


def read_force_sensor(entry: Table) -> ForceSensor:
    """Read the sensor of forces of an arm."""
    sensor = ForceSensor(
        noise=entry.number("noise_N", default=0.0, lower=0.0, upper=1e4),
        bias=entry.number("bias_N", default=0.0, lower=-1e4, upper=1e4),
        moment_noise=entry.number("noise_Nm", default=0.0, lower=0.0, upper=1e4),
        moment_bias=entry.number("bias_Nm", default=0.0, lower=-1e4, upper=1e4),
        rate=entry.number("rate_hz", default=0.0, lower=0.0, upper=1e5),
    )
    entry.refuse_unknown_keys()
    return sensor


def read_plant(entry: Table, model: Arm, folder: Path) -> Arm:
    """Read the arm that stands in the world, where it is another than the controller believes.

    Raises:
        FileFormatError: there is no such arm, or it has other joints, or its masses are unknown.
    """
    name = entry.text("model")
    try:
        arm = weighed(load_arm(regular_file(folder / name) if is_path(name) else name))
    except ArmwrightError as error:
        raise entry.error("model", str(error)) from error
    if [joint.kind for joint in arm.joints] != [joint.kind for joint in model.joints]:
        kinds = ", ".join(joint.kind for joint in model.joints)
        raise entry.error("model", f"expected an arm with the joints of the model ({kinds}), got '{arm.name}'")
    entry.refuse_unknown_keys()
    return arm


def read_alarms(entry: Table) -> Alarms:
    """Read what stops a program in a cell with physics."""
    alarms = Alarms(
        touch=entry.number("touch_N", default=20.0, lower=1e-3, upper=1e6),
        tracking_angle=np.radians(entry.number("tracking_deg", default=1.0, lower=1e-3, upper=180.0)),
        tracking_length=entry.number("tracking_mm", default=10.0, lower=1e-3, upper=1e4) * 1e-3,
        slip=entry.number("slip_mm", default=5.0, lower=1e-3, upper=1e4) * 1e-3,
    )
    entry.refuse_unknown_keys()
    return alarms
