"""What the words of the language mean, each in one sentence, with the form that it is written in."""

from collections.abc import Mapping

import attrs

from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, NORMAL_SPEED


@attrs.frozen
class Word:
    """A word of the language.

    Attributes:
        form: how it is written.
        text: what it does.
    """

    form: str
    text: str


_MOVE = "MOVE moved TO place [DIRECTLY | STRAIGHTLY] [VIA (places)] [WITH ... = ...] [ON condition DO action]"
_IF = "IF condition THEN statement [ELSE statement]"
_FOR = "FOR variable = first TO last [STEP step] DO statement"
_COBEGIN = "COBEGIN [PRIORITY number :] BEGIN ... END ; BEGIN ... END COEND"
_TRY = "TRY statements RECOVER statements END"
_AFFIX = "AFFIX frame TO frame [AT step] [RIGIDLY | NONRIGIDLY]"
_ARRAY = "name : ARRAY [sizes] OF type"

WORDS: Mapping[str, Word] = {
    # in front of BEGIN
    "VAR": Word("VAR name, name : TYPE ;", "Declares variables: SCALAR, TRANS, FRAME or EVENT, single or in an ARRAY."),
    "UNITS": Word("UNITS MM, DEG ;", "Settles what bare lengths and angles count; metres and degrees without it."),
    "IMPORT": Word('IMPORT "file" ;', "Brings the frames of a cell file, and its arms where no other cell is given."),
    "PROCEDURE": Word(
        "PROCEDURE name (a, b : TYPE, c : TYPE) ; [VAR ...] BEGIN ... END ;",
        "Declares a procedure: SCALAR and TRANS are handed over as values, FRAME, EVENT and arrays themselves.",
    ),
    "BEGIN": Word("BEGIN statements END", "Opens the statements of the program, of a procedure, or a block."),
    "END": Word("BEGIN statements END", "Closes what BEGIN or TRY opened; the END of the program has a point."),
    "SCALAR": Word("name : SCALAR", "A number."),
    "TRANS": Word("name : TRANS", "A step from one frame to another: a turn and a shift."),
    "FRAME": Word("name : FRAME", "A place with an orientation; it may hang on another frame and follow it."),
    "EVENT": Word("name : EVENT", "Counts SIGNALs; WAIT waits for one and takes it."),
    "ARRAY": Word(_ARRAY, "Declares elements that are told apart by indices from 1."),
    "OF": Word(_ARRAY, "Stands in front of the type of the elements."),
    # frames
    "AFFIX": Word(_AFFIX, "Hangs the first frame on the second: it follows from now on, where it stands or AT a step."),
    "AT": Word(_AFFIX, "The step (a TRANS) from the frame below to the one that hangs on it."),
    "RIGIDLY": Word(_AFFIX, "The frame below comes along when the hanging one is given another place."),
    "NONRIGIDLY": Word(_AFFIX, "The frame below stays when the hanging one is given another place; so without a word."),
    "UNFIX": Word("UNFIX frame [FROM frame]", "Cuts a frame loose; it keeps its place."),
    "FROM": Word("UNFIX frame FROM frame", "Names the frame that the other hangs on."),
    # tools and sensors
    "OPEN": Word("OPEN arm [TO width]", "Opens the fingers of an arm."),
    "GRASP": Word("GRASP [arm]", "Closes the fingers; without an arm, those of the arm that was named or moved last."),
    "OPERATE": Word("OPERATE device [ON | OFF]", "Switches a device on or off; all are off when the program ends."),
    "OFF": Word("OPERATE device OFF", "Switches a device off."),
    "READ": Word(
        "READ VISIONS (frames) | READ SYSTEM (arm)",
        "Asks the camera where frames are, or the joint sensors where the hand is.",
    ),
    "VISIONS": Word("READ VISIONS (frames)", "Asks the camera; what it sees is where the frames are."),
    "SYSTEM": Word("READ SYSTEM (arm)", "Reads the joint sensors of an arm; what hangs on its hand follows."),
    # motion
    "MOVE": Word(_MOVE, "Moves an arm, or a frame that hangs on one, until it stands at the place."),
    "DIRECTLY": Word(_MOVE, "The shortest way for the joints, all at once; so without a word too."),
    "STRAIGHTLY": Word(_MOVE, "In one straight line."),
    "VIA": Word("MOVE moved TO place VIA (places)", "Passes through places without a stop."),
    "WITH": Word(
        "WITH APPROACH | DEPARTURE | SPEED | BLEND | DURATION = value", "Says more about the way or the time."
    ),
    "APPROACH": Word("WITH APPROACH = place", "Comes to the goal in a straight line from this place."),
    "DEPARTURE": Word("WITH DEPARTURE = place", "Leaves the start in a straight line to this place."),
    "SPEED": Word(
        "WITH SPEED = number",
        f"From {LOWEST_SPEED:g} to {HIGHEST_SPEED:g}: {NORMAL_SPEED:g} is the normal speed, "
        f"{HIGHEST_SPEED:g} the largest the arm allows.",
    ),
    "BLEND": Word("WITH BLEND = distance", "Goes straight between via points and rounds the corners within this."),
    "DURATION": Word("WITH DURATION = seconds", "How long the motion takes, instead of a speed."),
    # control
    "IF": Word(_IF, "Chooses between two statements."),
    "THEN": Word(_IF, "In front of what is done when the condition holds."),
    "ELSE": Word(_IF, "In front of what is done when the condition does not hold."),
    "WHILE": Word("WHILE condition DO statement", "Repeats a statement as long as the condition holds."),
    "REPEAT": Word(
        "REPEAT statements UNTIL condition", "Repeats statements, at least once, until the condition holds."
    ),
    "UNTIL": Word("REPEAT statements UNTIL condition", "Ends the loop when the condition holds."),
    "FOR": Word(_FOR, "Repeats a statement while a SCALAR counts."),
    "STEP": Word(_FOR, "What the variable grows by each time; 1 without it."),
    "DO": Word("WHILE ... DO | FOR ... DO | LOCK ... DO | ON ... DO", "In front of the statement that is meant."),
    "AND": Word("condition AND condition", "Holds when both hold."),
    "OR": Word("condition OR condition", "Holds when one of them holds, or both."),
    "NOT": Word("NOT condition", "Holds when the condition does not."),
    "HALT": Word("HALT", "Ends the program; in an action of ON, or a procedure that it calls, that motion alone."),
    "PRINT": Word('PRINT ("text", value, ...)', "Prints texts and values on one line."),
    "PAUSE": Word("PAUSE seconds", "Waits that long."),
    # processes
    "COBEGIN": Word(_COBEGIN, "Runs blocks side by side and waits for all of them; an arm belongs to one of them."),
    "COEND": Word(_COBEGIN, "Closes COBEGIN."),
    "PRIORITY": Word(_COBEGIN, "Of branches that ask at one instant, the one with the larger number comes first."),
    "SIGNAL": Word("SIGNAL event", "Adds one to an event."),
    "WAIT": Word("WAIT event", "Waits until an event has been signalled, and takes one from it."),
    "LOCK": Word(
        "LOCK (variables) DO statement", "Keeps other LOCKs of these variables waiting until the statement is done."
    ),
    # recovery
    "TRY": Word(_TRY, "Runs statements; when one of them fails, those behind RECOVER run instead of the rest."),
    "RECOVER": Word(_TRY, "In front of what is done when something behind TRY fails."),
    "RETRY": Word("RETRY", "Inside RECOVER: runs the statements behind TRY again."),
    # functions
    "XYZ": Word("XYZ (x, y, z)", "A TRANS: a shift without a turn, in the lengths of the program."),
    "ROTX": Word("ROTX (angle)", "A TRANS: a turn about x."),
    "ROTY": Word("ROTY (angle)", "A TRANS: a turn about y."),
    "ROTZ": Word("ROTZ (angle)", "A TRANS: a turn about z."),
    "INV": Word("INV (step)", "The step back; INV(f) * g is the step from frame f to frame g."),
    "DIST": Word("DIST (frame, frame)", "How far two frames are apart, in the lengths of the program."),
    "FORCE": Word("FORCE (X | Y | Z)", "The force at the moving hand along an axis of the world, in newtons."),
}

# Words with another meaning behind another one that starts the statement.
_HERE: Mapping[tuple[str, str], Word] = {
    ("AFFIX", "TO"): Word(_AFFIX, "In front of the frame to hang on."),
    ("OPEN", "TO"): Word("OPEN arm TO width", "How far to open the fingers, in the lengths of the program."),
    ("FOR", "TO"): Word(_FOR, "In front of the last value; bounds are worked out once, before the loop."),
    ("MOVE", "TO"): Word(_MOVE, "In front of the place to come to."),
    ("OPERATE", "ON"): Word("OPERATE device ON", "Switches a device on; so without a word too."),
    ("MOVE", "ON"): Word(
        "ON condition DO action",
        "Looks at the condition at every tick of the motion; acts once, when it first holds. HALT ends the motion.",
    ),
}


def explained(word: str, statement: str = "") -> Word | None:
    """Return what a word means.

    Args:
        word: in upper case.
        statement: the word that starts the statement it stands in.
    """
    here = _HERE.get((statement, word))
    if here is None and word in ("TO", "ON"):
        here = _HERE["MOVE", word]
    return here or WORDS.get(word)
