"""Kinds of errors, which a RECOVER may name: those of the language, by the codes of their messages."""

from collections.abc import Mapping

# What a program may be in trouble with, each with what it stands for.
KINDS: Mapping[str, str] = {
    "MOTION": "a MOVE that an arm cannot make, or that was stopped",
    "CAMERA": "the camera has found nothing",
    "DEVICE": "a device, an input, a gripper or a sensor does not do what was asked",
    "TIMEOUT": "a wait has lasted too long",
    "FRAMES": "a frame without a pose, or one that cannot be attached",
    "VALUE": "a value that is missing or out of range, or a computation without a result",
    "PROCESS": "two branches that use one arm, or too many processes",
}
