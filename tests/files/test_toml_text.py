"""Entries of TOML files changed in their text: nothing else changes, in whatever layout it stands."""

import re
import tomllib

import numpy as np
import pytest

from armwright.files.toml_text import TomlLayoutError, with_entry, with_name, without_entry
from samples import Sample

HEAD = '# The cell.\nname = "a # b"  # a name\n\n[arms.ARM_1]  # the arm\nmodel = "x"\nhand = [1, 0,  # first\n  0]\n'
TAIL = '\n# The end.\n[joint_targets]  # J\nHOME = { arm = "ARM_1", joint_positions = [0] }  # home\n'


def entries(rng: np.random.Generator) -> str:
    """A table of frames in some layout, a comment at every entry."""
    names = [f"F{number}" for number in range(rng.integers(1, 6))]
    layouts = {
        "{name} = [{number}, 0]  # about {name}": True,
        '# of {name}\n{name} = {{ on = "F0", at = [{number},\n  0] }}  # about {name}': True,
        '{name}.at = [{number}]  # about {name}\n{name}.on = "F0"  # on': True,
        '[frames.{name}]  # about {name}\nat = [{number}]  # at\non = "F0"': False,
    }
    layout = str(rng.choice(list(layouts)))
    rows = [layout.format(name=name, number=number) for number, name in enumerate(names)]
    return "\n".join([*(["[frames]  # here"] if layouts[layout] else []), *rows, ""])


def comments(text: str) -> list[str]:
    return re.findall(r"# [\w ]+", text)


def test_any_layout(sample: Sample) -> None:
    """A change does what it says, keeps every comment in its order, or is refused."""
    refused = 0
    for rng in sample.cases(1000):
        text = HEAD + entries(rng) + TAIL
        before = tomllib.loads(text)
        names = list(before["frames"])
        key = str(rng.choice([*names, "NEW"]))
        try:
            after = with_entry(text, ("frames",), key, "[7, 8]")
            assert tomllib.loads(after) == {**before, "frames": {**before["frames"], key: [7, 8]}}
            assert comments(after) == comments(text)
        except TomlLayoutError:
            refused += 1
        gone = without_entry(text, ("frames",), names[0])
        assert tomllib.loads(gone).get("frames", {}) == {name: before["frames"][name] for name in names[1:]}
        assert [it for it in comments(text) if names[0] not in it and it not in {"# at", "# on"}] == [
            it for it in comments(gone) if names[0] not in it and it not in {"# at", "# on"}
        ]
        renamed = with_name(text, "frames", names[-1], "OTHER")
        expected = {"OTHER" if name == names[-1] else name: value for name, value in before["frames"].items()}
        assert list(tomllib.loads(renamed)["frames"].items()) == list(expected.items())
        assert comments(renamed) == comments(text)
    assert refused < sample.count(1000)


def test_a_new_table() -> None:
    """A table that is not there is put at the end."""
    assert with_entry("a = 1", ("frames",), "P", "[1]") == "a = 1\n\n[frames]\nP = [1]\n"
    with pytest.raises(TomlLayoutError, match=r"frames\.P cannot be changed by itself"):
        with_entry("frames = { A = [1] }\n", ("frames",), "P", "[1]")
