"""Random programs whose statements are interrupted by WHENs that brake, move elsewhere, resume, fail, or do nothing."""

import numpy as np

_INPUTS = ("A", "B", "C")


def watching_statements(rng: np.random.Generator) -> str:
    """Return statements for one arm, with frames f, g, h and k, SCALARs n and m, an EVENT ready and inputs A, B, C."""
    parts = [_when(rng, 0), _when(rng, 0), *(_statement(rng, 0) for _ in range(4))]
    return "m = 1 ;\n" + " ;\n".join(parts)


def _choice(rng: np.random.Generator, *texts: str) -> str:
    return texts[int(rng.integers(len(texts)))]


def _statement(rng: np.random.Generator, depth: int) -> str:
    kind = int(rng.integers(10 if depth < 3 else 7))
    if kind < 4:
        return _move(rng)
    if kind < 7:
        return _choice(
            rng,
            f"PAUSE {rng.uniform(0, 0.2):.3f}",
            f"WAIT UNTIL INPUT({_choice(rng, *_INPUTS)}) WITHIN 0.2 ELSE n = 2",
            *("GRASP ARM_1", "OPEN ARM_1", "WAIT ready WITHIN 0.1 ELSE n = 3", "SIGNAL ready"),
        )
    inner = [_statement(rng, depth + 1) for _ in range(2)]
    watch = _when(rng, depth + 1)
    return _choice(
        rng,
        f"LOCK (n) DO {inner[0]}",
        f"BEGIN {watch} ; {inner[0]} ; {inner[1]} END",
        f"TRY {watch} ; {inner[0]} ; n = n / m RECOVER m = 1 END",
    )


def _move(rng: np.random.Generator) -> str:
    action = _choice(rng, "HALT", "n = n + 1", "BEGIN PAUSE 0.05 ; MOVE ARM_1 TO f END", "BEGIN PAUSE 0.1 END")
    return _choice(
        rng,
        f"MOVE ARM_1 TO g WITH SPEED = {rng.integers(40, 120)}",
        "MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 60",
        "MOVE ARM_1 TO h VIA (k, f), WITH SPEED = 100",
        "MOVE ARM_1 TO f",
        f"MOVE ARM_1 TO k WITH APPROACH = h, ON INPUT({_choice(rng, *_INPUTS)}) DO {action}",
    )


def _when(rng: np.random.Generator, depth: int) -> str:
    others = [
        _choice(rng, "BRAKE", "RESUME", _statement(rng, depth + 2), _statement(rng, depth + 2), "n = n + 1", "m = 0")
        for _ in range(int(rng.integers(1, 5)))
    ]
    body = " ; ".join([*["BRAKE"] * int(rng.integers(2)), *others, *["RESUME"] * int(rng.integers(2))])
    condition = f"{_choice(rng, '', 'NOT ')}INPUT({_choice(rng, *_INPUTS)})"
    return f"WHEN PRIORITY {rng.integers(4)} : {condition} DO BEGIN {body} END"
