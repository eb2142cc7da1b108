"""Random programs of what can be exported in program mode."""

import numpy as np

FRAMES = ("a", "b", "c", "d")
HEAD = """UNITS MM ;
CONST lift = XYZ(0, 0, -60) ; half = 0.5 ;
VAR a, b, c, d, part, home : FRAME ; aside : TRANS ;
    grid : ARRAY [2,2] OF FRAME ;
    n, m, i, j, k : SCALAR ; flag : BOOLEAN ;

FUNCTION beside(f : FRAME, k : SCALAR) : FRAME ;
BEGIN
  IF k > 2 THEN RETURN f * XYZ(0, 10, 0) ELSE RETURN f * XYZ(10*k, 0, 0)
END ;

PROCEDURE visit(f : FRAME, k : SCALAR) ;
VAR high : FRAME ;
BEGIN
  high = f * lift ;
  MOVE ARM_1 TO beside(f, k) WITH APPROACH = high, WITH SPEED = 40 + 10*k ;
  k = k + 1 ;
END ;

PROCEDURE carry(INOUT part : FRAME, there : FRAME) ;
BEGIN
  MOVE ARM_1 TO part WITH APPROACH = part * lift ;
  GRASP ARM_1 ;
  AFFIX part TO ARM_1 ;
  MOVE part TO there WITH DEPARTURE = part * lift ;
  OPEN ARM_1 ;
  UNFIX part FROM ARM_1 ;
END ;

PROCEDURE add(INOUT n : SCALAR, by : SCALAR) ;
BEGIN
  n = n + by ;
END ;

BEGIN
  home = ARM_1 ; n = 1 ; m = 2 ; flag = FALSE ; aside = XYZ(10, 0, 5) ;
"""


class Writer:
    """A random program while it is written."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def text(self) -> str:
        """The program."""
        poses = [f"  {name} = {self.pose()} ;" for name in (*FRAMES, "part")]
        grid = "  FOR i = 1 TO 2 DO FOR j = 1 TO 2 DO AFFIX grid[i,j] TO a AT XYZ(20*(i-1), 20*(j-1), 0) ;"
        body = self.block(int(self.rng.integers(4, 9)), 2)
        return "\n".join([HEAD, *poses, grid, *body, "END.\n"])

    def pick(self, *choices: str) -> str:
        """One of some texts."""
        return str(self.rng.choice(choices))

    def number(self, low: float, high: float) -> str:
        """A number with one digit behind the point."""
        return f"{self.rng.uniform(low, high):.1f}"

    def pose(self) -> str:
        """A pose above the bench, the tool pointing down."""
        place = ", ".join(self.number(*limits) for limits in ((370, 430), (-80, 80), (100, 170)))
        return f"WORLD * XYZ({place}) * RPY(180, 0, {self.number(-25, 25)})"

    def goal(self) -> str:
        """Where a MOVE leads."""
        index = self.pick("1", "2")
        return self.pick(
            self.pick(*FRAMES),
            f"{self.pick(*FRAMES)} * aside",
            f"grid[{index},{self.pick('1', '2', 'm')}]",
            f"beside({self.pick(*FRAMES)}, n)",
            f"{self.pick(*FRAMES)} * ROTZ({self.number(-10, 10)})",
            "ARM_1 * XYZ(0, 0, -10)",
        )

    def condition(self) -> str:
        """A condition."""
        return self.pick(
            "n > 1", "m < n", "INPUT(large)", "NOT INPUT(part_there)", "flag", "n > 1 AND INPUT(large)",
            "flag OR Z(a) > 130", f"DIST({self.pick(*FRAMES)}, home) > 100", "OUTPUT(lamp)",
        )  # fmt: skip

    def block(self, count: int, depth: int) -> list[str]:
        """Some statements."""
        return [self.statement(depth) + " ;" for _ in range(count)]

    def inner(self, depth: int) -> str:
        """A block in a statement."""
        return "BEGIN " + " ".join(self.block(int(self.rng.integers(1, 4)), depth - 1)) + " END"

    def statement(self, depth: int) -> str:  # noqa: C901, PLR0911 - one case per kind
        """A statement."""
        kinds = ["move", "move", "move", "via", "place", "affix", "number", "output", "print", "wait", "call"]
        kinds += ["if", "for", "while", "repeat"] if depth else []
        f, g = self.rng.choice(FRAMES, 2, replace=False)
        match self.pick(*kinds):
            case "move":
                how = self.pick(
                    "", " STRAIGHTLY", f" WITH SPEED = {self.pick('60', '20 + 10*n')}", f" WITH APPROACH = {f} * lift"
                )
                return f"MOVE ARM_1 TO {self.goal()}{how}"
            case "via":
                return f"MOVE ARM_1 TO {g} VIA ({f} * lift, {g} * lift){self.pick('', ', WITH BLEND = 10')}"
            case "place":
                return f"{f} = {self.pick(f'{g} * XYZ(0, 0, 5)', f'{f} * ROTZ(5)', f'home * (INV(home) * {f})')}"
            case "affix":
                return self.pick(f"AFFIX {max(f, g)} TO {min(f, g)}", f"UNFIX {f}", "carry(part, a)")
            case "number":
                return self.pick("n = n + 1", "m = 1", "add(n, half)", "flag = n > m", "n = X(a) / 400")
            case "output":
                return self.pick("OPERATE lamp ON", "OPERATE lamp OFF", "PULSE torch FOR 0.1", "OPEN ARM_1")
            case "print":
                return self.pick('PRINT("at", n, m)', 'PRINT("passed")', "PRINT(n / 3)")
            case "wait":
                late = self.pick("", ' ELSE PRINT("late")')
                return self.pick("PAUSE 0.1", "PAUSE n / 10", f"WAIT UNTIL INPUT(part_there) WITHIN 2{late}")
            case "call":
                return f"visit({self.goal()}, {self.pick('1', 'n', 'm')})"
            case "if":
                otherwise = f" ELSE {self.inner(depth)}" if self.rng.random() < 0.6 else ""
                return f"IF {self.condition()} THEN {self.inner(depth)}{otherwise}"
            case "for":
                head = self.pick("1 TO 2", "2 TO 1 STEP -1", "1 TO m", "0 TO 1 STEP 0.5")
                variable = "i" if depth > 1 else "j"
                return f"FOR {variable} = {head} DO {self.inner(depth)}"
            case "while":
                return f"BEGIN k = 1 ; WHILE k < 3 DO BEGIN {self.statement(0)} ; k = k + 1 END END"
        return f"BEGIN k = 2 ; REPEAT {self.statement(0)} ; k = k - 1 UNTIL k < 1 END"
