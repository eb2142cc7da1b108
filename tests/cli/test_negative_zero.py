"""No command prints a zero with a sign."""

import re

import pytest

from cli_calls import armwright

SIGNED_ZERO = re.compile(r"(?<![\w.])-0(?:\.0*)?(?![\d.e])")


@pytest.mark.parametrize(
    "command",
    [
        ("singularity", "puma560", "-q", "10,20,30,40,0,50"),
        ("singularity", "puma560", "-q", "10,20,30,40,-0.00001,50"),
        ("singularity", "stanford", "-q", "0,0,500,0,0,0"),
        ("forward", "puma560", "-q", "0,-90,90,0,0,0"),
        ("jacobian", "puma560", "-q", "0,-90,90,0,0,0"),
        ("inverse", "puma560", "--xyz", "500,149.5,300", "--rpy", "0,90,0"),
        ("inverse", "ur5", "--xyz", "400,0,300", "--rpy", "180,0,0"),
        ("torque", "puma560", "-q", "0,-90,90,0,0,0"),
        ("show", "ur5"),
        ("show", "stanford"),
        ("simulate", "puma560", "-q", "0,-90,90,0,0,0", "--duration", "0.05"),
    ],
    ids=" ".join,
)
def test_zeros_have_no_sign(command: tuple[str, ...]) -> None:
    """What rounds to zero is printed as zero, from whichever side it comes."""
    done = armwright(*command, columns=200)

    assert done.returncode == 0, done.stderr
    assert re.search(r"\d", done.stdout)
    assert SIGNED_ZERO.findall(done.stdout) == []
