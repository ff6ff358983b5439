"""Find paths around things: past a wall, to a pose with any elbow, around what comes, and with a glass upright."""

import os

import heptarm as ha
from heptarm import model, shapes

LEFT, RIGHT = ha.deg(-40, 50, 0, -80, 0, 50, 0), ha.deg(40, 50, 0, -80, 0, 50, 0)

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(LEFT), speed=0.6)
    world = ha.CollisionModel(arm.robot.name)
    world.add("wall", shapes.box(0.5, 0.02, 0.6), at=ha.Pose.at(0.6, 0, 0.3))

    path = arm.find_path(RIGHT, avoid=world, timeout=30)
    print("around the wall:", path)
    arm.move(path)

    path = arm.find_path(ha.Pose.of((0.5, -0.35, 0.4), (0, 1, 0, 0)), avoid=world, timeout=30)
    print("back, to a pose:", path)
    arm.move([path, ha.lin_rel(z=-0.05, frame="base")])

    world.add("crate", shapes.box(0.3, 0.3, 0.3), at=ha.Pose.at(0.6, 0.4, 0.15))
    try:
        arm.find_path(ha.Pose.of((0.6, 0.4, 0.2), (0, 1, 0, 0)), avoid=world, timeout=30)
    except ha.NoPath as error:
        print("refused:", error.text)

    def look(progress: float) -> None:  # stands for the thread of a camera
        if progress > 0.1 and "visitor" not in world.bodies:
            world.add("visitor", shapes.sphere(0.05), at=ha.Pose.of(ahead))

    path = arm.find_path(LEFT, avoid=world, timeout=30)
    ahead = model.forward(arm.robot, path.curve[len(path.curve) * 2 // 3])[:3, 3]
    print("past a visitor:", arm.follow(path, speed=0.2, on_progress=look))
    world.remove("visitor")

    path = arm.find_path(
        RIGHT + ha.deg(20, 0, 0, 0, 0, 0, 0), avoid=world, keep=ha.Upright("z", within=0.3), timeout=60
    )
    print("with a glass:", path)
    arm.move(path)
