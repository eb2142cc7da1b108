"""What the words of the language mean, each in one sentence, with the form that it is written in."""

from collections.abc import Mapping
from typing import NamedTuple

from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, NORMAL_SPEED


class WordDoc(NamedTuple):
    """A word of the language.

    Attributes:
        syntax: how it is written.
        text: what it does.
    """

    syntax: str
    text: str


_QUEUE = "QUEUE arm [WITH CAPACITY | SPEED | VELOCITY | BLEND = number] DO statement"
_MOVE = "MOVE frame TO goal [DIRECTLY | STRAIGHTLY | CIRCULARLY] [SMOOTHLY] [VIA (poses)] [WITH ...] [ON ... DO ...]"
_IF = "IF condition THEN statement [ELSE statement]"
_FOR = "FOR variable = first TO last [STEP step] DO statement"
_COBEGIN = "COBEGIN [PRIORITY number :] BEGIN ... END ; BEGIN ... END COEND"
_TRY = "TRY statements RECOVER [(kinds)] statements END"
_AFFIX = "AFFIX frame TO frame [AT transformation] [RIGIDLY | NONRIGIDLY]"
_ARRAY = "name : ARRAY [sizes] OF type"

_DOCS: Mapping[str, tuple[str, str]] = {
    # in front of BEGIN
    "VAR": ("VAR name, name : TYPE ;", "Declares variables: SCALAR, TRANS, FRAME or EVENT, single or in an ARRAY."),
    "UNITS": ("UNITS MM, DEG ;", "Sets the units of bare lengths and angles; the default is metres and degrees."),
    "MODULE": ("MODULE name ;", "Makes a module of this file, whose names other programs can IMPORT."),
    "IMPORT": (
        'IMPORT "file" [AS name] ;',
        "Imports the names of a module, or the frames of a cell file, and its arms if no other cell is specified.",
    ),
    "RECORD": (
        "RECORD name ; field, field : TYPE ; ... END ;",
        "Declares a type whose variables have named fields, written `variable.field`.",
    ),
    "AS": ('IMPORT "file.rlo" AS name ;', "The names of the module are written `name.x` in this file."),
    "PROCEDURE": (
        "PROCEDURE name (a, b : TYPE, c : TYPE) ; [VAR ...] BEGIN ... END ;",
        "Declares a procedure: SCALAR and TRANS are passed by value; FRAME, EVENT and arrays by reference.",
    ),
    "FUNCTION": (
        "FUNCTION name (a, b : TYPE) : TYPE ; [VAR ...] BEGIN ... RETURN value END ;",
        "Declares a function: it works out a value, and changes no variable but its own.",
    ),
    "RETURN": ("RETURN value", "Ends a FUNCTION; the value is that of its call."),
    "IN": ("PROCEDURE name (IN a : TYPE)", "The parameter is passed as usual for its type."),
    "INOUT": (
        "PROCEDURE name (INOUT a : TYPE)",
        "The parameter is another name of the variable that is given for it, and sets it.",
    ),
    "BEGIN": ("BEGIN statements END", "Opens the statements of the program, of a procedure, or a block."),
    "END": ("BEGIN statements END", "Closes a BEGIN or TRY; the END of the program is followed by a full stop."),
    "SCALAR": ("name : SCALAR", "A number."),
    "TRANS": ("name : TRANS", "A transformation from one frame to another: a rotation and a translation."),
    "FRAME": ("name : FRAME", "A position and an orientation; a frame that is affixed to another one follows it."),
    "BOOLEAN": ("name : BOOLEAN", "A condition: TRUE, FALSE, or what comparisons, AND, OR and NOT give."),
    "TEXT": (
        "name : TEXT",
        "Characters, for messages; as a function, the text that PRINT would write of its arguments.",
    ),
    "CONST": ("CONST name = value ;", "Declares constants; the type of each is that of its value."),
    "EVENT": ("name : EVENT", "A counter of SIGNALs; WAIT waits until it is above 0 and subtracts one."),
    "ARRAY": (_ARRAY, "Declares an array, whose indices start at 1."),
    "OF": (_ARRAY, "Precedes the type of the elements."),
    # frames
    "AFFIX": (_AFFIX, "Lets the first frame follow the second, from its present pose or AT a transformation."),
    "AT": (_AFFIX, "The transformation (a TRANS) from the parent frame to the affixed frame."),
    "RIGIDLY": (_AFFIX, "The parent frame moves along when the affixed frame is assigned another pose."),
    "NONRIGIDLY": (_AFFIX, "The parent frame stays when the affixed frame is assigned another pose; the default."),
    "UNFIX": ("UNFIX frame [FROM frame]", "Detaches a frame from its parent; its pose does not change."),
    "FROM": ("UNFIX frame FROM frame", "Names the parent frame."),
    # tools and sensors
    "OPEN": ("OPEN arm [TO width]", "Opens the fingers of an arm."),
    "GRASP": ("GRASP [arm]", "Closes the fingers; without an arm, those of the arm that was named or moved last."),
    "OPERATE": (
        "OPERATE device [ON | OFF] | OPERATE device TO number",
        "Switches a device on or off, or sets an analogue one; all are off when the program ends.",
    ),
    "TIMER": (
        "TIMER name ON | OFF | TO seconds",
        "Starts, stops or sets a timer; as a function, TIMER(name) are its seconds.",
    ),
    "PULSE": ("PULSE device FOR seconds", "Switches a device on for this time, while the program goes on."),
    "OFF": ("OPERATE device OFF", "Switches a device off."),
    "READ": (
        "READ VISIONS (frames) | READ SYSTEM (arm)",
        "Measures the poses of frames with the camera, or the pose of the gripper with the joint sensors.",
    ),
    "VISIONS": ("READ VISIONS (frames)", "Assigns the poses that the camera measures to the frames."),
    "SYSTEM": ("READ SYSTEM (arm)", "Reads the joint sensors of an arm; frames affixed to its gripper follow."),
    "ZERO FORCE": (
        "ZERO FORCE arm",
        "From now on FORCE and TORQUE of an arm are what is measured less what is measured now.",
    ),
    # motion
    "MOVE": (_MOVE, "Moves an arm, or a frame that is affixed to an arm, to the pose of the goal."),
    "DIRECTLY": (_MOVE, "Moves all joints at once, without a straight path of the tool; this is the default."),
    "STRAIGHTLY": (_MOVE, "Moves the tool in a straight line."),
    "CIRCULARLY": (
        "MOVE frame TO goal CIRCULARLY, VIA (pose)",
        "Moves the tool on an arc of a circle through the position of another pose.",
    ),
    "SMOOTHLY": (
        "MOVE frame TO goal [STRAIGHTLY,] SMOOTHLY",
        "Shapes the motion so that an arm with flexible gears does not vibrate at its end; it takes a little longer.",
    ),
    "VIA": ("MOVE frame TO goal VIA (poses)", "Passes through poses without a stop."),
    "WITH": (
        "WITH APPROACH | DEPARTURE | SPEED | BLEND | DURATION | VELOCITY | ROTATION | ACCELERATION | ... = value",
        "Specifies approach, departure, speed, rounding of corners, duration, limits of the tool, or a frame to track.",
    ),
    "APPROACH": ("WITH APPROACH = pose", "Approaches the goal in a straight line from this pose."),
    "DEPARTURE": ("WITH DEPARTURE = pose", "Leaves the start in a straight line to this pose."),
    "SPEED": (
        "WITH SPEED = number",
        f"From {LOWEST_SPEED:g} to {HIGHEST_SPEED:g}, the maximum of the arm; {NORMAL_SPEED:g} is the normal speed.",
    ),
    "BLEND": (
        "WITH BLEND = distance",
        "Rounds the corners at via points within this distance, or that from one MOVE to the next.",
    ),
    "DURATION": ("WITH DURATION = seconds", "The duration of the motion, instead of a speed."),
    "VELOCITY": (
        "WITH VELOCITY = length",
        "The tool point moves at this length per second at most, and at that speed where the arm can; not with SPEED.",
    ),
    "ROTATION": ("WITH ROTATION = angle", "The tool turns by this angle per second at most."),
    "ACCELERATION": (
        "WITH ACCELERATION = length",
        "In each second the speed of the tool point changes by this length per second at most.",
    ),
    "TRACKING": (
        "WITH TRACKING = frame",
        "The goal goes with a frame of the cell that moves; the arm comes to it, and follows it until its next MOVE.",
    ),
    "CORRECTION": (
        "WITH CORRECTION = length, WITH BOUND = length, WITH RATE = length",
        "How far beside its line the path of a straight MOVE is to be, looked at while the arm moves, as by a sensor.",
    ),
    "BOUND": ("WITH BOUND = length", "How far a CORRECTION may move the path at most; more is an error."),
    "RATE": ("WITH RATE = length", "How far a CORRECTION may move the path in a second."),
    "QUEUE": (
        _QUEUE,
        "Lets an arm run along frames that PUT puts in meanwhile, without a stop, and ends when it stands at the last.",
    ),
    "PUT": (
        "PUT frame TO arm [ELSE statement]",
        "Puts a frame into the queue of an arm; where that is full, waits, or runs the statement behind ELSE instead.",
    ),
    "CAPACITY": (
        "WITH CAPACITY = number | CAPACITY (arm)",
        "How many frames of a queue may be ahead of its arm; 8 without it.",
    ),
    "QUEUED": ("QUEUED (arm)", "How many frames of its queue are ahead of an arm, the next among them."),
    "AWAITED": ("AWAITED (arm, number)", "A frame of the queue of an arm: 1 is the one that it is on the way to."),
    # control
    "IF": (_IF, "Chooses between two statements."),
    "THEN": (_IF, "Precedes the statement that runs when the condition holds."),
    "ELSE": (_IF, "Precedes the statement that runs when the condition does not hold."),
    "WHILE": ("WHILE condition DO statement", "Repeats a statement as long as the condition holds."),
    "REPEAT": ("REPEAT statements UNTIL condition", "Repeats statements, at least once, until the condition holds."),
    "UNTIL": ("REPEAT statements UNTIL condition", "Ends the loop when the condition holds."),
    "FOR": (_FOR, "Repeats a statement while a SCALAR counts."),
    "STEP": (_FOR, "The increment of the variable in each pass; 1 without it."),
    "DO": (
        "WHILE ... DO | FOR ... DO | LOCK ... DO | ON ... DO | WHEN ... DO",
        "Precedes the statement that it governs.",
    ),
    "AND": ("condition AND condition", "Holds when both hold."),
    "OR": ("condition OR condition", "Holds when one of them holds, or both."),
    "NOT": ("NOT condition", "Holds when the condition does not."),
    "HALT": ("HALT", "Ends the program; in an action of ON, or a procedure that it calls, that motion alone."),
    "PRINT": ('PRINT ("text", value, ...)', "Prints texts and values on one line."),
    "LOG": ('LOG "name" (value, ...)', "Writes a row with the time to the file log-NAME.csv of the results."),
    "PAUSE": ("PAUSE seconds", "Waits for this time."),
    # processes
    "COBEGIN": (_COBEGIN, "Runs blocks side by side and waits for all of them; an arm belongs to one of them."),
    "COEND": (_COBEGIN, "Closes COBEGIN."),
    "PRIORITY": (_COBEGIN, "Of branches that run at the same time, the one with the larger number is served first."),
    "SIGNAL": ("SIGNAL event", "Adds one to an event."),
    "WAIT": (
        "WAIT event | UNTIL condition [WITHIN seconds [ELSE statement]]",
        "Waits until an event has been signalled, and takes one from it; or until a condition holds.",
    ),
    "WITHIN": (
        "WAIT event | UNTIL condition WITHIN seconds [ELSE statement]",
        "The longest time of the wait; when it is over the statement runs, and without one it is an error.",
    ),
    "WHEN": (
        "WHEN [name :] [PRIORITY number :] condition DO statement",
        "Runs the statement whenever the condition comes true on a servo tick, until the end of its block.",
    ),
    "BRAKE": ("BRAKE", "In the action of a WHEN: stops the MOVE that it interrupts on its path, and waits for that."),
    "RESUME": ("RESUME", "In the action of a WHEN: lets the MOVE that it has braked go on, from where it was braked."),
    "LOCK": ("LOCK (variables) DO statement", "Other LOCKs of these variables wait until the statement has ended."),
    # recovery
    "TRY": (_TRY, "Runs statements; when one of them fails, those after RECOVER run instead of the rest."),
    "RECOVER": (
        _TRY,
        "Precedes the statements that run when a statement after TRY fails, with an error of these kinds.",
    ),
    "RAISE": (
        "RAISE kind [WITH text]",
        "Fails with an error of the program's own, from which a TRY around it recovers.",
    ),
    "RETRY": ("RETRY", "Inside RECOVER: runs the statements after TRY again."),
    # functions
    "XYZ": ("XYZ (x, y, z)", "A TRANS: a translation without a rotation, in the length unit of the program."),
    "ROTX": ("ROTX (angle)", "A TRANS: a rotation about x."),
    "ROTY": ("ROTY (angle)", "A TRANS: a rotation about y."),
    "ROTZ": ("ROTZ (angle)", "A TRANS: a rotation about z."),
    "INV": ("INV (transformation)", "The inverse; INV(f) * g is the transformation from frame f to frame g."),
    "DIST": ("DIST (frame, frame)", "The distance between two frames, in the length unit of the program."),
    "RPY": ("RPY (roll, pitch, yaw)", "A TRANS: rotations about the fixed axes x, then y, then z."),
    "ROT": ("ROT (x, y, z, angle)", "A TRANS: a rotation about the axis (x, y, z), of any length."),
    "X": ("X (pose)", "The x coordinate of a FRAME in the world, or of a TRANS, in the length unit of the program."),
    "Y": ("Y (pose)", "The y coordinate of a FRAME in the world, or of a TRANS, in the length unit of the program."),
    "Z": ("Z (pose)", "The z coordinate of a FRAME in the world, or of a TRANS, in the length unit of the program."),
    "ROLL": ("ROLL (pose)", "The rotation about the fixed axis x, the first of RPY, from -180 to 180 degrees."),
    "PITCH": ("PITCH (pose)", "The rotation about the fixed axis y, the second of RPY, from -90 to 90 degrees."),
    "YAW": ("YAW (pose)", "The rotation about the fixed axis z, the last of RPY, from -180 to 180 degrees."),
    "ANGLE": ("ANGLE (pose)", "The angle of the rotation about its axis, from 0 to 180 degrees."),
    "AXISX": ("AXISX (pose)", "The x component of the axis of the rotation, a vector of length 1."),
    "AXISY": ("AXISY (pose)", "The y component of the axis of the rotation, a vector of length 1."),
    "AXISZ": ("AXISZ (pose)", "The z component of the axis of the rotation, a vector of length 1."),
    "ABS": ("ABS (number)", "The number without its sign."),
    "SQRT": ("SQRT (number)", "The square root."),
    "SIN": ("SIN (angle)", "The sine; exact at multiples of 90 degrees."),
    "COS": ("COS (angle)", "The cosine; exact at multiples of 90 degrees."),
    "TAN": ("TAN (angle)", "The tangent."),
    "ASIN": ("ASIN (number)", "The angle that has this sine, from -90 to 90 degrees."),
    "ACOS": ("ACOS (number)", "The angle that has this cosine, from 0 to 180 degrees."),
    "ATAN2": ("ATAN2 (y, x)", "The direction of the point (x, y), from -180 to 180 degrees."),
    "ROUND": ("ROUND (number)", "The nearest whole number; 2.5 becomes 3, and -2.5 becomes -3."),
    "MOD": ("MOD (a, b)", "The remainder of a / b, with the sign of b."),
    "MIN": ("MIN (a, b, ...)", "The smallest of the numbers."),
    "MAX": ("MAX (a, b, ...)", "The largest of the numbers."),
    # values
    "PI": ("PI", "The number 3.14159..."),
    "MESSAGE": ("MESSAGE", "The text of the error that this process has recovered from last."),
    "TRUE": ("TRUE", "The condition that holds."),
    "FALSE": ("FALSE", "The condition that does not hold."),
    "TIME": ("TIME", "The time on the clock of the cell since the program began, in seconds."),
    # motion by joints
    "JOINTS": (
        "JOINTS (q1, q2, ...) | JOINTS (target)",
        "The goal of a MOVE by the position of each joint, an angle or a length, or by a joint target of the cell.",
    ),
    # sensors
    "INPUT": ("INPUT (name)", "A condition: whether a digital input of the cell is on."),
    "ANALOG": ("ANALOG (name)", "The number of an analogue input of the cell."),
    "OUTPUT": ("OUTPUT (device)", "A condition: whether a device is on."),
    "SETTING": ("SETTING (device)", "The number that a device is set to; 1 where it is on, 0 where it is off."),
    "FORCE": ("FORCE (X | Y | Z)", "The force on the gripper of the moving arm along an axis of the world, in N."),
    "TORQUE": (
        "TORQUE (X | Y | Z)",
        "The moment on the gripper of the moving arm about its tool point, along an axis of the world, in N m.",
    ),
}

WORDS = {word: WordDoc(*doc) for word, doc in _DOCS.items()}

# Words with another meaning behind another one that starts the statement.
_STATEMENT_WORDS: Mapping[tuple[str, str], tuple[str, str]] = {
    ("AFFIX", "TO"): (_AFFIX, "Precedes the parent frame."),
    ("OPEN", "TO"): ("OPEN arm TO width", "The width to open the fingers to, in the length unit of the program."),
    ("FOR", "TO"): (_FOR, "Precedes the last value; both bounds are evaluated once, before the loop."),
    ("MOVE", "TO"): (_MOVE, "Precedes the goal."),
    ("OPERATE", "ON"): ("OPERATE device ON", "Switches a device on; this is the default."),
    ("TIMER", "ON"): ("TIMER name ON", "Lets a timer run, on from where it stands."),
    ("TIMER", "OFF"): ("TIMER name OFF", "Stops a timer, which keeps its seconds."),
    ("TIMER", "TO"): (
        "TIMER name TO seconds",
        "Sets a timer, which runs on from there, or stands there.",
    ),
    ("PUT", "TO"): ("PUT frame TO arm", "Precedes the arm whose queue gets the frame."),
    ("PUT", "ELSE"): ("PUT frame TO arm ELSE statement", "Precedes what is done instead where the queue is full."),
    ("QUEUE", "DO"): (_QUEUE, "Precedes the statements that fill the queue."),
    ("WHEN", "ON"): ("WHEN name ON", "Arms a WHEN again that was disarmed."),
    ("WHEN", "OFF"): ("WHEN name OFF", "Disarms a WHEN until it is armed again."),
    ("WHEN", "PRIORITY"): (
        "WHEN [name :] PRIORITY number : condition DO statement",
        "An action of a larger number is served first, and interrupts one of a smaller; 0 by default.",
    ),
    ("MOVE", "ON"): (
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
    doc = _STATEMENT_WORDS.get((statement, word)) or _STATEMENT_WORDS.get(("MOVE", word))
    return WORDS.get(word) if doc is None else WordDoc(*doc)
