"""Numbers on the command line: named ones, bounded ones and lists."""

import pytest
import typer

from armwright.cli.numbers import named_numbers, named_ranges, numbers, within


def test_named_numbers() -> None:
    """A number with a name has a unit that may be left out, blanks do no harm, and an exponent may be small."""
    texts = ["J2=0.3", "J3 = -1.5 mm", "J4=1e-3mm", "J5=.5", "J6=2E+1"]

    found = named_numbers(texts, ("", "mm"), "a pin", "--clearance")

    assert list(found.values()) == [
        ("J2", 0.3, ""),
        ("J3", -1.5, "mm"),
        ("J4", 1e-3, "mm"),
        ("J5", 0.5, ""),
        ("J6", 20.0, ""),
    ]
    assert named_numbers(["AV=1mm/s"], None, "a limit", "--limit")["AV"].unit == "mm/s"


@pytest.mark.parametrize("text", ["J2", "J2=", "=0.3", "J2=thick", "J2=0.3cm", "J2=nan", "J2=0.3=0.4", "J2=1_0"])
def test_malformed_named_numbers(text: str) -> None:
    """What is something else is refused, with what was expected."""
    with pytest.raises(typer.BadParameter, match=f"expected a pin and its clearance, got {text}$"):
        named_numbers([text], ("", "mm"), "a pin and its clearance", "--clearance")


def test_long_malformed_number_takes_linear_time() -> None:
    """A hundred thousand digits with a sign behind them are refused in the time of their length, not its square."""
    with pytest.raises(typer.BadParameter, match="expected a pin"):
        named_numbers([f"J2={'1' * 100_000}!"], ("", "mm"), "a pin", "--clearance")


def test_name_given_twice() -> None:
    """Of two numbers of one name none is dropped without a word."""
    with pytest.raises(typer.BadParameter, match="J2 occurs twice"):
        named_numbers(["J2=0.3", "J3=0.3", "J2=0.4"], ("", "mm"), "a pin", "--clearance")


def test_numbers_within_bounds() -> None:
    """A number within its bounds, ends included, is taken; any other is refused with the bounds."""
    assert [within(x, (0.1, 10), "--servo-ms") for x in (0.1, 1, 10)] == [0.1, 1, 10]
    for value in (0.09, 10.1, float("nan")):
        with pytest.raises(typer.BadParameter, match=f"expected 0.1 to 10, got {value:g}"):
            within(value, (0.1, 10), "--servo-ms")


def test_lists_of_numbers() -> None:
    """Numbers stand apart by commas or blanks, and there must be as many as joints."""
    assert numbers("1, 2.5 -3", 3, "-q") == [1.0, 2.5, -3.0]
    with pytest.raises(typer.BadParameter, match="expected 2 finite numbers, got 3"):
        numbers("1,2,3", 2, "-q")


def test_named_ranges() -> None:
    """Ranges have a name and two numbers, the second above the first; each name occurs once."""
    assert named_ranges(["payload=0:0.2", "torque_scale = .98:1.02"], "--vary") == {
        "payload": (0.0, 0.2),
        "torque_scale": (0.98, 1.02),
    }


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["payload=0.2"], "expected a name and a range such as payload=0:0.2, got payload=0.2"),
        (["payload=0:1e999"], "every number must be finite"),
        (["payload=0.2:0.1"], "payload: expected a range whose second number is larger, got 0.2:0.1"),
        (["payload=0:1", "payload=0:2"], "payload occurs twice"),
    ],
)
def test_malformed_named_ranges(texts: list[str], said: str) -> None:
    """Anything else is refused with what was expected."""
    with pytest.raises(typer.BadParameter, match=said):
        named_ranges(texts, "--vary")
