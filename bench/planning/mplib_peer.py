"""Solves problems with mplib, in its environment, and prints what it took: see `bench.planning.rivals`."""

from __future__ import annotations

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

#: Longest step of its search [rad]: its default of 0.1 solves one problem of 25, 1.2 fewer than this.
RANGE = 0.5
#: Time between two points of its trajectories [s].
STEP = 0.02


def planner(folder: Path, task: dict[str, Any]) -> Any:
    """The planner, with all bodies in its world."""
    import mplib
    from mplib.collision_detection import fcl

    made = mplib.Planner(
        urdf=str(folder / "arm.urdf"),
        srdf=str(folder / "arm.srdf"),
        move_group="link_7",
        joint_vel_limits=np.array(task["speed"]),
        joint_acc_limits=np.array(task["acceleration"]),
    )
    world = made.planning_world
    makers = {
        "box": fcl.Box,
        "cylinder": lambda size: fcl.Cylinder(*size),
        "sphere": lambda size: fcl.Sphere(*size),
    }
    allowed = world.get_allowed_collision_matrix()
    for number, (kind, size, at, turn) in enumerate(task["bodies"]):
        name, pose = f"body{number}", mplib.Pose(at, turn)
        shape = fcl.CollisionObject(makers[kind](size), pose)
        world.add_object(fcl.FCLObject(name, pose, [shape], [mplib.Pose()]))
        for link in ("link_0", "link_1"):  # the foot is on the floor
            allowed.set_entry(link, name, True)
    return made


def main() -> None:
    """Check postures, then solve all problems."""
    folder = Path(sys.argv[1])
    task = json.loads((folder / "task.json").read_text(encoding="utf-8"))
    made = planner(folder, task)
    postures = np.array(task["postures"])
    touch = []
    begin = time.process_time()
    for q in postures:
        made.robot.set_qpos(q, True)
        touch.append(bool(made.planning_world.is_state_colliding()))
    check = (time.process_time() - begin) / len(postures) * 1e6
    found = []
    for start, goal in task["problems"]:
        begin = time.process_time()
        answer = made.plan_qpos(
            [np.array(goal)],
            np.array(start),
            time_step=STEP,
            rrt_range=RANGE,
            planning_time=4.0 * task["longest"],
            simplify=True,
        )
        took = time.process_time() - begin
        if answer["status"] == "Success":
            found.append((took, float(np.linalg.norm(np.diff(answer["position"], axis=0), axis=1).sum())))
        else:
            found.append((float("inf"), float("nan")))
    print(json.dumps({"version": version("mplib"), "touch": touch, "check_us": check, "found": found}))


if __name__ == "__main__":
    main()
