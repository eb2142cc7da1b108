"""URDF files with mistakes in them: what each is answered with."""

import math
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from armwright.arm.description import tables
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.errors import FileFormatError, InvalidValueError, KindError, MissingExtraError, UnknownNameError
from urdf_texts import ARM_WITH_GRIPPER, LIMIT, MASS, joint, link, one, robot


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Arm]:
    """Write a text into a file and read it as an arm."""

    def write(text: str, **options: object) -> Arm:
        (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
        return load_urdf(tmp_path / "arm.urdf", **options)

    return write


def test_twins_are_told_apart_by_line(read: Callable[..., Arm]) -> None:
    """Two links of one name are refused with both lines."""
    with pytest.raises(FileFormatError, match=r"arm.urdf:3: link 'a', name: another link has this name, in line 2"):
        read(robot(link("a"), link("a")))


def test_a_word_of_a_million_digits(read: Callable[..., Arm]) -> None:
    """What begins as a number for long and is none is refused at once, not tried with every digit given back."""
    place = f'<origin xyz="{"1" * 1_000_000}x 0 0"/>'

    with pytest.raises(FileFormatError, match=r"joint 'j', origin, xyz: expected a number, got '1111"):
        read(robot(link("a"), link("b"), joint("j", "revolute", "a", "b", LIMIT + place)))


FORK = (
    *(link(name) for name in ("base", "a", "b")),
    joint("ja", "continuous", "base", "a"),
    joint("jb", "continuous", "base", "b"),
)
MISTAKES: dict[str, tuple[str, str]] = {
    "nothing": ("", "arm.urdf:1: not valid XML: Document is empty"),
    "no XML": ("hello", "arm.urdf:1: not valid XML: Start tag expected, '<' not found"),
    "not closed": (one().replace("</link>", "", 1), "arm.urdf:5: not valid XML: Opening and ending tag mismatch"),
    "another format": ("<sdf/>", "arm.urdf:1: expected <robot>, as URDF files have, got <sdf>"),
    "xacro": (
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:include filename="a"/></robot>',
        "arm.urdf:2: <include>: expand xacro files to URDF first: xacro arm.urdf > arm-expanded.urdf",
    ),
    "xacro without its namespace": (
        "<robot><xacro:include/></robot>",
        "Namespace prefix xacro on include is not defined; expand xacro files to URDF first",
    ),
    "xacro beside another prefix": (
        "<robot><drake:acceleration/><xacro:include/></robot>",
        "Namespace prefix xacro on include is not defined; expand xacro files to URDF first",
    ),
    "a prefix in what is no XML": (
        "<robot><drake:acceleration/>\n<link></robot>",
        "arm.urdf:2: not valid XML: Opening and ending tag mismatch",
    ),
    "a property of xacro": (
        one(f'<origin xyz="0 0 ${{height}}"/>{LIMIT}'),
        "joint 'turn', origin, xyz: expected a number, got '${height}'; expand xacro files",
    ),
    "no link": ("<robot/>", "arm.urdf:1: expected at least one <link> in <robot>"),
    "a link without a name": (robot("<link/>"), "arm.urdf:2: link, name: missing"),
    "a joint without a name": (robot(link("a"), "<joint/>"), "arm.urdf:3: joint, type: missing"),
    "no parent": (one().replace('<parent link="base"/>', ""), "joint 'turn': expected <parent> in it"),
    "a link that does not exist": (
        one().replace('<child link="hand"/>', '<child link="hnad"/>'),
        "arm.urdf:4: joint 'turn', child, link: there is no link 'hnad'; did you mean 'hand'?",
    ),
    "unknown kind": (
        one(kind="revolut"),
        "one of fixed, revolute, continuous, prismatic, planar, floating, got 'revolut'; did you mean 'revolute'?",
    ),
    "planar": (one(kind="planar"), "joint 'turn', type: an arm cannot have a planar joint"),
    "floating": (one(kind="floating"), "joint 'turn', type: an arm cannot have a floating joint"),
    "mimic": (
        one(f'{LIMIT}<mimic joint="trun"/>'),
        "joint 'turn', mimic, joint: there is no joint 'trun'; did you mean 'turn'?",
    ),
    "mimics of one another": (
        one(f'{LIMIT}<mimic joint="turn"/>'),
        "joint 'turn', mimic, joint: joints follow one another in a cycle: 'turn'",
    ),
    "mimic without a joint": (
        one(f'{LIMIT}<mimic multiplier="2"/>'),
        "joint 'turn', mimic, joint: missing",
    ),
    "nothing moves": (
        robot(link("base"), link("hand"), joint("weld", "fixed", "base", "hand")),
        "arm.urdf: no joint moves a link below 'base'",
    ),
    "twin joints": (
        robot(*FORK).replace('"jb"', '"ja"'),
        "joint 'ja', name: another joint has this name, in line 5",
    ),
    "two parents": (
        robot(*FORK, joint("jc", "fixed", "a", "b")),
        "arm.urdf:7: joint 'jc', child: link 'b' is already the child of joint 'jb'",
    ),
    "a ring": (
        robot(link("a"), link("b"), link("c"), joint("ab", "fixed", "a", "b"), joint("ba", "fixed", "b", "a")),
        "links form a cycle: 'a', 'b'",
    ),
    "two roots": (
        robot(link("a"), link("b")),
        "arm.urdf: the base link is ambiguous: it could be 'a', 'b'; specify one as base (--base)",
    ),
    "two ends": (
        robot(*FORK),
        "it could be 'a', 'b', or a link before them; specify one as tip: load_urdf(path, tip='a')",
    ),
    "no room between limits": (
        one('<limit lower="0.5" upper="0.5" effort="1" velocity="1"/>'),
        "a joint without limits has the type continuous, one that does not move the type fixed",
    ),
    "no limit": (
        one(""),
        "joint 'turn': a revolute joint needs <limit>; a joint without limits has the type cont",
    ),
    "limits left out": (
        one('<limit effort="1" velocity="1"/>'),
        "joint 'turn', limit: the lower limit must be below the upper, got 0 and 0, where an omitted one is 0",
    ),
    "limits reversed": (
        one('<limit lower="2" upper="1"/>'),
        "limit: the lower limit must be below the upper, got 2 and 1",
    ),
    "negative effort": (
        one('<limit lower="0" upper="1" effort="-1"/>'),
        "joint 'turn', limit, effort: expected 0 or more, got -1",
    ),
    "negative damping": (one(f'{LIMIT}<dynamics damping="-1"/>'), "dynamics, damping: expected 0 or more, got -1"),
    "no direction": (
        one(f'<axis xyz="0 0 -0.0"/>{LIMIT}'),
        "joint 'turn', axis, xyz: expected a direction, got the axis 0 0 0",
    ),
    "an axis in two dimensions": (one(f'<axis xyz="0 1"/>{LIMIT}'), "axis, xyz: expected 3 numbers, got 2"),
    "not a number": (one(f'<axis xyz="0 0 nan"/>{LIMIT}'), "axis, xyz: expected a number, got 'nan'"),
    "a comma": (one(f'<axis xyz="0,0,1"/>{LIMIT}'), "axis, xyz: expected a number, got '0,0,1'"),
    "endless": (one('<limit lower="-inf" upper="1"/>'), "limit, lower: expected a number, got '-inf'"),
    "too large": (one(f'<origin xyz="0 0 1e200"/>{LIMIT}'), "expected a number no larger than 1e+100, got '1e200'"),
    "given twice": (one(LIMIT + LIMIT), "joint 'turn', limit: occurs twice, first in line 4"),
    "a misspelt element": (
        one().replace("limit", "limits"),
        "joint 'turn', limits: unknown element; did you mean <limit>?",
    ),
    "a misspelt attribute": (one().replace("upper", "uper"), "limit, uper: unknown attribute; did you mean 'upper'?"),
    "another turn": (
        one(f'<origin quat_xyzw="0 0 0 1"/>{LIMIT}'),
        "joint 'turn', origin, quat_xyzw: unknown attribute; expected xyz or rpy",
    ),
    "an entity": (
        f'<!DOCTYPE r [<!ENTITY file SYSTEM "/etc/hostname">]>{one()}'.replace(LIMIT, "&file;"),
        "joint 'turn': a revolute joint needs <limit>",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes(mistake: str, read: Callable[..., Arm]) -> None:
    """Every mistake is told with file, line, element and attribute."""
    text, message = MISTAKES[mistake]

    with pytest.raises(FileFormatError) as caught:
        read(text)

    assert message in str(caught.value)


BODIES: dict[str, tuple[str, str]] = {
    "no mass": (MASS.replace('<mass value="2"/>', ""), "arm.urdf:3: link 'hand', inertial: expected <mass> in it"),
    "no inertia": ('<inertial><mass value="2"/></inertial>', "link 'hand', inertial: expected <inertia> in it"),
    "a moment left out": (MASS.replace('ixx="1"', ""), "link 'hand', inertial, inertia, ixx: missing"),
    "a negative mass": (MASS.replace('"2"', '"-2"'), "inertial, mass, value: expected 0 or more, got -2"),
    "misspelt": (
        MASS.replace("inertial", "inertail"),
        "link 'hand', inertail: unknown element; did you mean <inertial>?",
    ),
}


@pytest.mark.parametrize("mistake", BODIES)
def test_mistakes_in_a_body(mistake: str, read: Callable[..., Arm]) -> None:
    """A body without a mass or with one below 0 would make the dynamics wrong, and is refused."""
    inside, message = BODIES[mistake]

    with pytest.raises(FileFormatError) as caught:
        read(one().replace('<link name="hand">', f'<link name="hand">{inside}'))

    assert message in str(caught.value)


def test_loads_that_nothing_holds(read: Callable[..., Arm]) -> None:
    """A rod with mass that follows a joint of the chain moves with it: it is refused by name, with the way out."""
    rod = '<axis xyz="0 1 0"/>' + LIMIT + '<mimic joint="turn" multiplier="-1"/>'
    text = ARM_WITH_GRIPPER.replace("</robot>", link("rod", MASS) + joint("follows", "revolute", "arm", "rod", rod))

    with pytest.raises(FileFormatError) as caught:
        read(f"{text}</robot>", tip="camera")

    assert (
        "joint 'follows': 1 joint lies beside the chain, has mass to carry and moves with other joints or freely: "
        "'follows'. An arm has no branches: choose another tip, or lock it, at 0 or elsewhere: lock=['follows'] "
        "(--lock follows)"
    ) in str(caught.value)
    assert read(f"{text}</robot>", tip="camera", lock=["follows"]).links[0].mass == 10


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"tip": "camrea"}, UnknownNameError, "no link 'camrea'. Did you mean 'camera'?"),
        ({"base": "bas"}, UnknownNameError, "no link 'bas'. Did you mean 'base'? Known: arm, base, camera"),
        ({"tip": "camera", "lock": ["left"]}, UnknownNameError, "no joint 'left'. Known: clip, left_slide"),
        ({"tip": "base"}, FileFormatError, "arm.urdf: no joint moves between the links 'base' and 'base'"),
        ({"base": "palm", "tip": "arm"}, FileFormatError, "arm.urdf: link 'arm' is not below link 'palm'"),
        ({"tip": 3}, UnknownNameError, "no link '3'"),
        (
            {"lock": "left_slide"},
            KindError,
            "lock: expected a list of names of joints, or positions by names, got 'left_slide'",
        ),
        ({"lock": {"turn": "1"}}, KindError, "lock, 'turn': expected a number, got '1'"),
        (
            {"lock": {"left_slide": 3.0}},
            InvalidValueError,
            "'left_slide' cannot be locked at 3 (rad or m): it goes from -1 ",
        ),
        (
            {"lock": {"turn": math.inf}},
            InvalidValueError,
            "joint 'turn' cannot be locked at inf (rad or m): it goes from -i",
        ),
        ({"lock": {"clip": 0.1}}, InvalidValueError, "joint 'clip' cannot be locked at 0.1 (rad or m): it is fixed"),
    ],
)
def test_wrong_choices(
    options: dict[str, object], kind: type[Exception], message: str, read: Callable[..., Arm]
) -> None:
    """Links and joints that are not there, or not in this order, are told with what there is."""
    with pytest.raises(kind) as caught:
        read(ARM_WITH_GRIPPER, **options)

    assert message in str(caught.value)


def test_no_such_file(tmp_path: Path) -> None:
    """A path without a file is told with the nearest name; what is no path is refused."""
    (tmp_path / "puma.urdf").write_text(one())

    with pytest.raises(FileFormatError, match=r"pumma.urdf: no such file; did you mean '.*puma.urdf'\?"):
        load_arm(tmp_path / "pumma.urdf")
    with pytest.raises(KindError, match="path: expected the path of a URDF file, got 3"):
        load_urdf(3)  # type: ignore[arg-type]


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the library that parses is not installed, the message has the command that installs it."""
    (tmp_path / "arm.urdf").write_text(one())
    monkeypatch.setitem(sys.modules, "lxml.etree", None)

    with pytest.raises(
        MissingExtraError, match=r"reading URDF needs lxml; install it by: pip install 'armwright\[urdf\]'"
    ):
        load_arm(tmp_path / "arm.urdf")
    assert issubclass(MissingExtraError, ImportError)


@pytest.mark.parametrize(("fingers", "tip"), [(2, "hand"), (1, "hand"), (0, "hand")])
def test_the_tip_that_is_likely_meant_is_proposed(fingers: int, tip: str, read: Callable[..., Arm]) -> None:
    """Of an arm of four joints with a camera on its second link: the hand that carries the fingers, not the camera."""
    names = ["base", "a", "b", "c", "hand", "camera", *(f"finger{k}" for k in range(fingers))]
    joints = [joint(f"j{k}", "revolute", names[k], names[k + 1], LIMIT) for k in range(4)]
    joints.append(joint("mount", "fixed", "b", "camera"))
    joints += [joint(f"grip{k}", "prismatic", "hand", f"finger{k}", LIMIT) for k in range(fingers)]
    links = [link(name) for name in names]
    if fingers == 1:
        links.append(link("palm"))
        joints.append(joint("palm_mount", "fixed", "hand", "palm"))

    with pytest.raises(FileFormatError, match=rf"the tip link is ambiguous: .* --tip {tip} -o arm.toml"):
        read(robot(*links, *joints))
    assert read(robot(*links, *joints), tip=tip).n == 4


def test_what_is_probably_in_another_unit_is_told(tmp_path: Path) -> None:
    """Limits in degrees and lengths in millimetres are read as they stand, with a question; 450° in rad without."""
    for unit, factor, asked in (("deg", 1.0, True), ("rad", math.pi / 180, False)):
        path = tmp_path / f"{unit}.urdf"
        limit = LIMIT.replace('"-1"', f'"{-450 * factor}"').replace('"2"', f'"{450 * factor}"')
        length = 450 if asked else 0.45
        path.write_text(one(f'<origin xyz="0 0 {length}"/>{limit}'))

        notes = read_urdf(path).notes

        assert ("the arm is 450 m long; are its lengths in millimetres?" in notes) == asked
        assert ("joint 1 ('turn') goes to 450 rad, 71.6 revolutions; are its limits in degrees?" in notes) == asked


def test_many_unknown_bodies(read: Callable[..., Arm]) -> None:
    """The tables of an arm name two links whose mass is unknown with the reason, and say how many more there are."""
    wrong = MASS.replace('ixx="1"', 'ixx="-1"')
    links = [link(f"l{k}", wrong) for k in range(5)]
    joints = [joint(f"j{k}", "revolute", f"l{k}", f"l{k + 1}", LIMIT) for k in range(4)]

    (said,) = (each.title for each in tables(read(robot(*links, *joints))) if "unknown" in each.title)

    assert said.count("a body cannot have the principal moments") == 2
    assert said.endswith("; and 2 more links")


def test_prefixes_of_other_programs(read: Callable[..., Arm]) -> None:
    """Elements and attributes with a prefix that the file does not define are those of another program: ignored."""
    limit = LIMIT.replace("/>", ' drake:acceleration="5"/>')

    assert read(one(f'{limit}<drake:rotor_inertia value="0.1"/>')).joints == read(one(LIMIT)).joints


def test_a_xacro_file_is_no_arm_file(tmp_path: Path) -> None:
    """A file of xacro is not read as TOML: the message says how it becomes URDF."""
    path = tmp_path / "arm.urdf.xacro"
    path.write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:include filename="a"/></robot>')

    with pytest.raises(FileFormatError, match="expand xacro files to URDF first"):
        load_arm(path)
