"""Random programs that hang, release and move frames along many ways, each statement on a line of its own."""

import random
from collections.abc import Iterator

# What the simple statements are, and how often.
_SIMPLE = (
    (8, "{frame} = {place}"),
    (5, "{frame} = {thing} * {step}"),
    (10, "AFFIX {frame} TO {thing}"),
    (8, "AFFIX {frame} TO {thing} AT {step}{rigid}"),
    (4, "UNFIX {frame}"),
    (5, "UNFIX {frame} FROM {thing}"),
    (5, "OPEN {arm}"),
    (5, "GRASP"),
    (6, "GRASP {arm}"),
    (2, "READ SYSTEM ({arm})"),
    (3, "k = {digit}"),
    (2, "t = {step}"),
    (2, "{frame} = {frame} * t"),
    (12, "MOVE {arm} TO {frame}"),
    (4, "MOVE {arm} TO {thing} * {step}"),
    (2, "MOVE {arm} TO {frame} ON n > {digit} DO\n{frame} = {place}"),
    (2, "MOVE {arm} TO {frame} ON n > {digit} DO\nHALT"),
    (16, "MOVE {frame} TO {frame}"),
)
_WEIGHTS, _TEXTS = [weight for weight, _ in _SIMPLE], [text for _, text in _SIMPLE]
_MAX_DEPTH = 3


class Wandering:
    """Writes one program."""

    def __init__(self, seed: int) -> None:
        """Choose what kind of program it will be."""
        self._random = random.Random(seed)
        self._frames = ["a", "b", "c", "d", "s[1]", "s[2]", "s[k]"]
        self._arms = ["ARM_1", "ARM_2"]
        self._rigid = self._random.choice(("", "", " RIGIDLY"))
        self._simple = self._random.choice((0.5, 0.7, 0.85))
        self._count = self._loops = self._depth = 0
        self._procedures: dict[str, int] = {}

    def program(self) -> str:
        """Return the text."""
        bodies = [self._procedure("fetch", ("p",)), self._procedure("pass", ("p", "q"))]
        given = [
            f"{name} = {self._place()}" for name in ("a", "b", "c", "d", "s[1]", "s[2]") if self._random.random() < 0.8
        ]
        body = [self._statement() for _ in range(self._random.randrange(3, 14))]
        loops = "".join(f"m{number} : SCALAR ; " for number in range(1, self._loops + 1))
        lines = [
            "VAR a, b, c, d : FRAME ; s : ARRAY [2] OF FRAME ; n, k : SCALAR ; t : TRANS ;",
            *([f"VAR {loops}"] if loops else []),
            *bodies,
            "BEGIN",
            " ;\n".join(["n = 0", "k = 1", *given, *body]),
            "END.",
        ]
        return "\n".join(lines) + "\n"

    def _procedure(self, name: str, parameters: tuple[str, ...]) -> str:
        outside, self._frames = self._frames, [*self._random.sample(self._frames, 3), *parameters, "own"]
        # Some call themselves.
        self._depth, here = 1, dict(self._procedures)
        if self._random.random() < 0.2:
            self._procedures[name] = len(parameters)
        body = self._block()
        self._depth, self._frames, self._procedures = 0, outside, {**here, name: len(parameters)}
        return f"PROCEDURE {name}({', '.join(parameters)} : FRAME) ;\nVAR own : FRAME ;\n{body} ;"

    # ---- statements ------------------------------------------------------------------------------------------------

    def _block(self) -> str:
        body = [self._statement() for _ in range(self._random.randrange(1, 5))]
        return "BEGIN\n" + " ;\n".join(body) + "\nEND"

    def _statement(self) -> str:
        if self._depth >= _MAX_DEPTH or self._random.random() < self._simple:
            text = self._random.choices(_TEXTS, _WEIGHTS)[0]
            return "".join(self._filled(text))
        self._depth += 1
        kinds = [self._if, self._for, self._counted, self._counted, self._attempt, self._call, self._call]
        text = self._random.choice([*kinds, self._branches] if len(self._arms) > 1 else kinds)()
        self._depth -= 1
        return text

    def _filled(self, text: str) -> Iterator[str]:
        """Give the parts of a statement with its blanks filled in."""
        choose = self._random.choice
        for part in text.replace("}", "{").split("{"):
            match part:
                case "frame":
                    yield choose(self._frames)
                case "arm":
                    yield choose(self._arms)
                case "thing":
                    yield self._thing()
                case "place":
                    yield self._place()
                case "step":
                    yield self._step()
                case "digit":
                    yield choose("12")
                case "rigid":
                    yield self._rigid
                case _:
                    yield part

    def _if(self) -> str:
        condition = self._random.choice(("n = 1", "n > 0", "k = 1", "n = 0"))
        if self._random.random() < 0.1:
            return f"IF {condition} THEN\nHALT"
        otherwise = f"\nELSE\n{self._block()}" if self._random.random() < 0.6 else ""
        return f"IF {condition} THEN\n{self._block()}{otherwise}"

    def _for(self) -> str:
        return f"FOR n = {self._random.choice('012')} TO {self._random.choice('123')} DO\n{self._block()}"

    def _counted(self) -> str:
        self._loops += 1
        m, last, body = f"m{self._loops}", self._random.choice("012"), self._block()
        if self._random.random() < 0.5:
            loop = f"WHILE {m} < {last} DO\nBEGIN\n{m} = {m} + 1 ;\n{body}\nEND"
        else:
            loop = f"REPEAT\n{m} = {m} + 1 ;\n{body}\nUNTIL {m} >= {last}"
        return f"BEGIN\n{m} = 0 ;\n{loop}\nEND"

    def _attempt(self) -> str:
        self._loops += 1
        m = f"m{self._loops}"
        again = f" ;\n{m} = {m} + 1 ;\nIF {m} < 2 THEN\nRETRY" if self._random.random() < 0.4 else ""
        return f"BEGIN\n{m} = 0 ;\nTRY\n{self._block()}\nRECOVER\n{self._block()}{again}\nEND\nEND"

    def _call(self) -> str:
        if not self._procedures:
            return self._block()
        name = self._random.choice(sorted(self._procedures))
        return f"{name}({', '.join(self._thing() for _ in range(self._procedures[name]))})"

    def _branches(self) -> str:
        arms, texts = self._arms, []
        for arm in arms:
            self._arms = [arm]
            texts.append(self._block())
        self._arms = arms
        return "COBEGIN\n" + " ;\n".join(texts) + "\nCOEND"

    # ---- words -----------------------------------------------------------------------------------------------------

    def _thing(self) -> str:
        return self._random.choice(self._arms if self._random.random() < 0.35 else self._frames)

    def _place(self) -> str:
        """Return a place within reach that no other frame has."""
        self._count += 1
        x, y, z = 0.5 + 0.001 * self._count, 0.001 * self._random.randrange(-80, 80), 0.12
        return f"(1,0,0, 0,-1,0, 0,0,-1, {x:.3f},{y:.3f},{z})"

    def _step(self) -> str:
        self._count += 1
        return f"XYZ(0, 0.00{self._random.randrange(1, 9)}, 0.00{self._count % 9 + 1})"
