"""What the words of the language mean, each in one sentence, with the form that it is written in."""

from collections.abc import Mapping

import attrs

from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, NORMAL_SPEED


@attrs.frozen
class WordDoc:
    """A word of the language.

    Attributes:
        syntax: how it is written.
        text: what it does.
    """

    syntax: str
    text: str


_MOVE = "MOVE frame TO goal [DIRECTLY | STRAIGHTLY] [VIA (poses)] [WITH ... = ...] [ON condition DO action]"
_IF = "IF condition THEN statement [ELSE statement]"
_FOR = "FOR variable = first TO last [STEP step] DO statement"
_COBEGIN = "COBEGIN [PRIORITY number :] BEGIN ... END ; BEGIN ... END COEND"
_TRY = "TRY statements RECOVER statements END"
_AFFIX = "AFFIX frame TO frame [AT transformation] [RIGIDLY | NONRIGIDLY]"
_ARRAY = "name : ARRAY [sizes] OF type"

WORDS: Mapping[str, WordDoc] = {
    # in front of BEGIN
    "VAR": WordDoc(
        "VAR name, name : TYPE ;", "Declares variables: SCALAR, TRANS, FRAME or EVENT, single or in an ARRAY."
    ),
    "UNITS": WordDoc(
        "UNITS MM, DEG ;", "Sets the units of bare lengths and angles; the default is metres and degrees."
    ),
    "IMPORT": WordDoc(
        'IMPORT "file" ;', "Imports the frames of a cell file, and its arms if no other cell is specified."
    ),
    "PROCEDURE": WordDoc(
        "PROCEDURE name (a, b : TYPE, c : TYPE) ; [VAR ...] BEGIN ... END ;",
        "Declares a procedure: SCALAR and TRANS are passed by value; FRAME, EVENT and arrays by reference.",
    ),
    "BEGIN": WordDoc("BEGIN statements END", "Opens the statements of the program, of a procedure, or a block."),
    "END": WordDoc("BEGIN statements END", "Closes a BEGIN or TRY; the END of the program is followed by a full stop."),
    "SCALAR": WordDoc("name : SCALAR", "A number."),
    "TRANS": WordDoc("name : TRANS", "A transformation from one frame to another: a rotation and a translation."),
    "FRAME": WordDoc(
        "name : FRAME", "A position and an orientation; a frame may be affixed to another frame and follows it then."
    ),
    "EVENT": WordDoc("name : EVENT", "A counter of SIGNALs; WAIT waits until it is above 0 and subtracts one."),
    "ARRAY": WordDoc(_ARRAY, "Declares an array, whose indices start at 1."),
    "OF": WordDoc(_ARRAY, "Precedes the type of the elements."),
    # frames
    "AFFIX": WordDoc(
        _AFFIX, "Affixes the first frame to the second and lets it follow: at its present pose, or AT a transformation."
    ),
    "AT": WordDoc(_AFFIX, "The transformation (a TRANS) from the parent frame to the affixed frame."),
    "RIGIDLY": WordDoc(_AFFIX, "The parent frame moves along when the affixed frame is assigned another pose."),
    "NONRIGIDLY": WordDoc(
        _AFFIX, "The parent frame stays when the affixed frame is assigned another pose; this is the default."
    ),
    "UNFIX": WordDoc("UNFIX frame [FROM frame]", "Detaches a frame from its parent; its pose does not change."),
    "FROM": WordDoc("UNFIX frame FROM frame", "Names the parent frame."),
    # tools and sensors
    "OPEN": WordDoc("OPEN arm [TO width]", "Opens the fingers of an arm."),
    "GRASP": WordDoc(
        "GRASP [arm]", "Closes the fingers; without an arm, those of the arm that was named or moved last."
    ),
    "OPERATE": WordDoc("OPERATE device [ON | OFF]", "Switches a device on or off; all are off when the program ends."),
    "OFF": WordDoc("OPERATE device OFF", "Switches a device off."),
    "READ": WordDoc(
        "READ VISIONS (frames) | READ SYSTEM (arm)",
        "Measures the poses of frames with the camera, or the pose of the gripper with the joint sensors.",
    ),
    "VISIONS": WordDoc("READ VISIONS (frames)", "Assigns the poses that the camera measures to the frames."),
    "SYSTEM": WordDoc(
        "READ SYSTEM (arm)", "Reads the joint sensors of an arm; frames that are affixed to its gripper follow."
    ),
    # motion
    "MOVE": WordDoc(_MOVE, "Moves an arm, or a frame that is affixed to an arm, to the pose of the goal."),
    "DIRECTLY": WordDoc(_MOVE, "Moves all joints at once, without a straight path of the tool; this is the default."),
    "STRAIGHTLY": WordDoc(_MOVE, "Moves the tool in a straight line."),
    "VIA": WordDoc("MOVE frame TO goal VIA (poses)", "Passes through poses without a stop."),
    "WITH": WordDoc(
        "WITH APPROACH | DEPARTURE | SPEED | BLEND | DURATION = value",
        "Specifies approach, departure, speed, rounding of corners or duration.",
    ),
    "APPROACH": WordDoc("WITH APPROACH = pose", "Approaches the goal in a straight line from this pose."),
    "DEPARTURE": WordDoc("WITH DEPARTURE = pose", "Leaves the start in a straight line to this pose."),
    "SPEED": WordDoc(
        "WITH SPEED = number",
        f"From {LOWEST_SPEED:g} to {HIGHEST_SPEED:g}: {NORMAL_SPEED:g} is the normal speed, "
        f"{HIGHEST_SPEED:g} the maximum of the arm.",
    ),
    "BLEND": WordDoc(
        "WITH BLEND = distance",
        "Moves in straight lines between via points and rounds the corners within this distance.",
    ),
    "DURATION": WordDoc("WITH DURATION = seconds", "The duration of the motion, instead of a speed."),
    # control
    "IF": WordDoc(_IF, "Chooses between two statements."),
    "THEN": WordDoc(_IF, "Precedes the statement that runs when the condition holds."),
    "ELSE": WordDoc(_IF, "Precedes the statement that runs when the condition does not hold."),
    "WHILE": WordDoc("WHILE condition DO statement", "Repeats a statement as long as the condition holds."),
    "REPEAT": WordDoc(
        "REPEAT statements UNTIL condition", "Repeats statements, at least once, until the condition holds."
    ),
    "UNTIL": WordDoc("REPEAT statements UNTIL condition", "Ends the loop when the condition holds."),
    "FOR": WordDoc(_FOR, "Repeats a statement while a SCALAR counts."),
    "STEP": WordDoc(_FOR, "The increment of the variable in each pass; 1 without it."),
    "DO": WordDoc("WHILE ... DO | FOR ... DO | LOCK ... DO | ON ... DO", "Precedes the statement that it governs."),
    "AND": WordDoc("condition AND condition", "Holds when both hold."),
    "OR": WordDoc("condition OR condition", "Holds when one of them holds, or both."),
    "NOT": WordDoc("NOT condition", "Holds when the condition does not."),
    "HALT": WordDoc("HALT", "Ends the program; in an action of ON, or a procedure that it calls, that motion alone."),
    "PRINT": WordDoc('PRINT ("text", value, ...)', "Prints texts and values on one line."),
    "PAUSE": WordDoc("PAUSE seconds", "Waits for this time."),
    # processes
    "COBEGIN": WordDoc(_COBEGIN, "Runs blocks side by side and waits for all of them; an arm belongs to one of them."),
    "COEND": WordDoc(_COBEGIN, "Closes COBEGIN."),
    "PRIORITY": WordDoc(
        _COBEGIN, "Of branches that run at the same time, the one with the larger number is served first."
    ),
    "SIGNAL": WordDoc("SIGNAL event", "Adds one to an event."),
    "WAIT": WordDoc("WAIT event", "Waits until an event has been signalled, and takes one from it."),
    "LOCK": WordDoc(
        "LOCK (variables) DO statement", "Other LOCKs of these variables wait until the statement has ended."
    ),
    # recovery
    "TRY": WordDoc(_TRY, "Runs statements; when one of them fails, those after RECOVER run instead of the rest."),
    "RECOVER": WordDoc(_TRY, "Precedes the statements that run when a statement after TRY fails."),
    "RETRY": WordDoc("RETRY", "Inside RECOVER: runs the statements after TRY again."),
    # functions
    "XYZ": WordDoc("XYZ (x, y, z)", "A TRANS: a translation without a rotation, in the length unit of the program."),
    "ROTX": WordDoc("ROTX (angle)", "A TRANS: a rotation about x."),
    "ROTY": WordDoc("ROTY (angle)", "A TRANS: a rotation about y."),
    "ROTZ": WordDoc("ROTZ (angle)", "A TRANS: a rotation about z."),
    "INV": WordDoc("INV (transformation)", "The inverse; INV(f) * g is the transformation from frame f to frame g."),
    "DIST": WordDoc("DIST (frame, frame)", "The distance between two frames, in the length unit of the program."),
    "FORCE": WordDoc(
        "FORCE (X | Y | Z)", "The force on the gripper of the moving arm along an axis of the world, in newtons."
    ),
}

# Words with another meaning behind another one that starts the statement.
_STATEMENT_WORDS: Mapping[tuple[str, str], WordDoc] = {
    ("AFFIX", "TO"): WordDoc(_AFFIX, "Precedes the parent frame."),
    ("OPEN", "TO"): WordDoc(
        "OPEN arm TO width", "The width to open the fingers to, in the length unit of the program."
    ),
    ("FOR", "TO"): WordDoc(_FOR, "Precedes the last value; both bounds are evaluated once, before the loop."),
    ("MOVE", "TO"): WordDoc(_MOVE, "Precedes the goal."),
    ("OPERATE", "ON"): WordDoc("OPERATE device ON", "Switches a device on; this is the default."),
    ("MOVE", "ON"): WordDoc(
        "ON condition DO action",
        "Checks the condition at every tick of the motion; acts once, when it first holds. HALT ends the motion.",
    ),
}


def word_doc(word: str, statement: str = "") -> WordDoc | None:
    """Return what a word means.

    Args:
        word: in upper case.
        statement: the word that starts the statement it stands in.
    """
    doc = _STATEMENT_WORDS.get((statement, word))
    if doc is None and word in ("TO", "ON"):
        doc = _STATEMENT_WORDS["MOVE", word]
    return doc or WORDS.get(word)
