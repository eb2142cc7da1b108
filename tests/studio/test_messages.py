"""Messages of pages: what is no command is refused in words, whatever it is."""

import json
from typing import Any

import attrs
import pytest
from hypothesis import given, settings, strategies as st

from armwright.studio import messages
from armwright.studio.messages import Jog, MessageError, SetJoint, read_message
from samples import examples

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=12,
)


def test_commands() -> None:
    """A command comes as it was sent."""
    assert read_message('{"do": "joint", "arm": "ARM_1", "joint": 2, "value": 0.5}') == SetJoint(
        arm="ARM_1", joint=2, value=0.5
    )
    jog = '{"do": "jog", "arm": "ARM_1", "frame": "TOOL", "axis": 3, "sign": -1, "share": 1}'
    assert read_message(jog) == Jog(arm="ARM_1", frame="TOOL", axis=3, sign=-1, share=1.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "expected JSON"),
        ("[" * 100_000, "expected JSON"),
        ("[]", "expected an object"),
        ('{"do": "jok"}', "no command 'jok'; did you mean jog?"),
        ('{"do": ["jog"]}', "no command"),
        ('{"do": "joint", "arm": "ARM_1", "joint": 1}', "joint: value is missing"),
        ('{"do": "joint", "arm": "ARM_1", "joint": 1, "value": NaN}', "expected a number within"),
        ('{"do": "joint", "arm": "ARM_1", "joint": 1, "value": 1e400}', "expected a number within"),
        ('{"do": "joint", "arm": "ARM_1", "joint": true, "value": 1}', "expected int"),
        ('{"do": "joint", "arm": "ARM_1", "joint": 1, "value": true}', "expected a number"),
        ('{"do": "joint", "arm": 3, "joint": 1, "value": 1}', "expected str"),
        ('{"do": "undo", "much": 1}', "no field 'much'"),
        ('{"do": "tool", "arm": "ARM_1", "pose": [1, "2"]}', "expected a number"),
        ('{"do": "grip", "arm": "' + "A" * 500 + '", "open": true}', "longer than 200"),
        ('{"do": "jog", "arm": "A", "frame": "TOOL", "axis": 1, "sign": 0, "share": 1}', "expected 1 or -1"),
    ],
)
def test_refused(text: str, told: str) -> None:
    """What is wrong is said."""
    with pytest.raises(MessageError, match=told.replace("?", r"\?")):
        read_message(text)


@settings(max_examples=examples(300), deadline=None)
@given(st.sampled_from(sorted(messages._COMMANDS)), st.dictionaries(st.text(max_size=8), JSON, max_size=4), st.data())
def test_anything(word: str, extra: dict[str, Any], data: st.DataObject) -> None:
    """Any object is a command with fields of the right kinds, or is refused."""
    fields = {field.name: data.draw(JSON) for field in attrs.fields(messages._COMMANDS[word])}
    content = {**fields, **(extra if data.draw(st.booleans()) else {}), "do": word}
    try:
        command = read_message(json.dumps(content))
    except MessageError:
        return
    assert isinstance(command, messages._COMMANDS[word])
    assert attrs.asdict(command).keys() == fields.keys()
