"""Files in which something was changed: read, or refused by an error of ours with the name of the file."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from samples import Sample

_FILE = Path(__file__).resolve().parents[1] / "fuzz" / "files.py"


def _fuzz() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fuzz_files", _FILE)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FUZZ = _fuzz()
# Those of which an input takes a second.
SLOW = ("step", "world")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.share(0.03)
@pytest.mark.parametrize("target", FUZZ.TARGETS)
@pytest.mark.drawn(0.4)
def test_changed_files(target: str, sample: Sample, tmp_path: Path) -> None:
    """Keys, numbers, lines and cells changed, lost, doubled, nested: no reader raises anything but its own error."""
    suffix, _, texts = FUZZ.TARGETS[target]
    valid, count = texts(), 0
    for rng in sample.cases(200 if target in SLOW else 2000):
        text = FUZZ.changed(valid, FUZZ.random.Random(int(rng.integers(1 << 62))))

        said = FUZZ.fails(target, tmp_path / f"input{suffix}", text)

        assert not said, f"{text}\n{said}"
        count += 1
    sample.record(f"changed files: {target}", count, 0)
