"""Trees of bodies on ideal joints, with numbers by chance; and the same for Pinocchio."""

import numpy as np
import pinocchio

from armwright.clearance.linkage import Body, BodyPoint, ClearancePin, Drive, Guide, Linkage, Load, Pin


def tree(rng: np.random.Generator) -> Linkage:
    """A pin on the ground, a guide on a rotating body, a pin on what slides, a pin on that, a guide on it, a free body.

    One pin with play joins the last of the tree to the free body. Every body has its centre anywhere, the drives push
    three joints, and a load pulls at the end.
    """

    def body(name: str) -> Body:
        points = {point: rng.uniform(-0.3, 0.3, 2) for point in ("a", "b", "c")}
        return Body(
            name=name,
            mass=rng.uniform(0.5, 2.0),
            inertia=rng.uniform(0.01, 0.05),
            centre=rng.uniform(-0.2, 0.2, 2),
            points=points,
        )

    def guide(name: str, on: str) -> Guide:
        direction, angle = rng.uniform(-np.pi, np.pi, 2)
        return Guide(body=name, point="a", on=BodyPoint(on, "b"), direction=direction, angle=angle)

    return Linkage(
        name="tree",
        zero=rng.uniform(-np.pi, np.pi),
        ground=Body(name="ground", points={"O": (0.1, -0.2)}),
        bodies=[body(name) for name in ("arm", "sledge", "lever", "finger", "bolt", "loose")],
        joints=[
            Pin(body="arm", point="a", on=BodyPoint("ground", "O")),
            guide("sledge", "arm"),
            Pin(body="lever", point="a", on=BodyPoint("sledge", "b")),
            Pin(body="finger", point="a", on=BodyPoint("lever", "b")),
            guide("bolt", "finger"),
        ],
        pins=[
            ClearancePin(
                name="eye",
                bearing=BodyPoint("bolt", "c"),
                journal=BodyPoint("loose", "b"),
                clearance=1e-3,
                journal_radius=0.02,
            )
        ],
        drives=[Drive(body="arm"), Drive(body="sledge"), Drive(body="lever")],
        loads=[Load(point=BodyPoint("bolt", "b"), force=rng.uniform(-5, 5, 2))],
        tip=BodyPoint("loose", "c"),
        gravity=rng.uniform(-10, 10, 2),
    )


def to_pinocchio(linkage: Linkage) -> tuple[pinocchio.Model, np.ndarray, np.ndarray]:
    """The ideal joints for Pinocchio, and T and s with which its coordinates are q_P = T q + s.

    Its angles are against the body that carries; ours are against the ground.
    """
    model = pinocchio.Model()
    model.gravity.linear = np.array((*linkage.gravity, 0.0))
    coordinates = linkage.coordinates
    T = np.zeros((len(coordinates), len(coordinates)))
    shift = np.zeros(len(coordinates))
    joints, turns, zeros = {"ground": 0}, {"ground": np.zeros(len(coordinates))}, {"ground": 0.0}
    # Pinocchio's frames begin where a body is held.
    origins = {"ground": np.zeros(2)}
    for body in linkage.bodies:
        joint, row = linkage.joint(body.name), model.nv
        if joint is None:
            number = planar(model)
            T[row : row + 3, row : row + 3] = np.eye(3)
            turns[body.name], shift[row + 2] = T[row + 2], linkage.zero
            origins[body.name] = body.centre
        else:
            on = np.array((*(linkage.point(joint.on) - origins[joint.on.body]), 0.0))
            origins[body.name] = body.points[joint.point]
            if isinstance(joint, Pin):
                number = model.addJoint(
                    joints[joint.on.body], pinocchio.JointModelRZ(), pinocchio.SE3(np.eye(3), on), body.name
                )
                turns[body.name] = np.eye(len(coordinates))[row]
                zeros[body.name] = linkage.zero
                T[row] = turns[body.name] - turns[joint.on.body]
                shift[row] = zeros[body.name] - zeros[joint.on.body]
            else:
                way = joint.direction - joint.angle
                slide = pinocchio.JointModelPrismaticUnaligned(np.array((np.cos(way), np.sin(way), 0.0)))
                number = model.addJoint(
                    joints[joint.on.body], slide, pinocchio.SE3(about_z(joint.angle), on), body.name
                )
                turns[body.name] = turns[joint.on.body]
                zeros[body.name] = zeros[joint.on.body] + joint.angle
                T[row, row] = 1.0
        joints[body.name] = number
        lever = np.array((*(body.centre - origins[body.name]), 0.0))
        inertia = pinocchio.Inertia(body.mass, lever, np.diag((0.0, 0.0, body.inertia)))
        model.appendBodyToJoint(number, inertia, pinocchio.SE3.Identity())
    return model, T, shift


def planar(model: pinocchio.Model) -> int:
    """A free body: two slides and a pin, of which only the last has mass."""
    number = model.addJoint(0, pinocchio.JointModelPX(), pinocchio.SE3.Identity(), f"x{model.nv}")
    number = model.addJoint(number, pinocchio.JointModelPY(), pinocchio.SE3.Identity(), f"y{model.nv}")
    return int(model.addJoint(number, pinocchio.JointModelRZ(), pinocchio.SE3.Identity(), f"turn{model.nv}"))


def about_z(angle: float) -> np.ndarray:
    return np.asarray(pinocchio.rpy.rpyToMatrix(0.0, 0.0, angle))
