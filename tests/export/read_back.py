"""Read models by usd-core and yourdfpy, in an environment that has them; prints poses and masses as JSON.

python read_back.py MODEL.usda MODEL.urdf Q1,...,Q7
"""

from __future__ import annotations

import json
import sys
from typing import Any


def read_usd(path: str) -> dict[str, Any]:
    """Pose of each prim in the base at joint position 0, mass of each body, joints with their limits."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(path)
    cache = UsdGeom.XformCache()
    found: dict[str, Any] = {"poses": {}, "masses": {}, "joints": {}, "resistance": {}}
    for one in stage.Traverse():
        if one.IsA(UsdGeom.Xform):
            matrix = cache.GetLocalToWorldTransform(one)
            found["poses"][one.GetName()] = [[matrix[j][i] for j in range(4)] for i in range(4)]
            if one.HasAPI(UsdPhysics.MassAPI):
                found["masses"][one.GetName()] = UsdPhysics.MassAPI(one).GetMassAttr().Get()
        elif one.IsA(UsdPhysics.RevoluteJoint):
            joint = UsdPhysics.RevoluteJoint(one)
            found["joints"][one.GetName()] = [
                joint.GetLowerLimitAttr().Get(),
                joint.GetUpperLimitAttr().Get(),
            ]
            drive = UsdPhysics.DriveAPI(one, "angular").GetDampingAttr()
            of_physx = [
                one.GetAttribute(f"physxJoint:{name}").Get() for name in ("jointFriction", "armature")
            ]
            found["resistance"][one.GetName()] = [drive.Get(), *of_physx]
    return found


def read_urdf(path: str, q: list[float]) -> dict[str, Any]:
    """Pose of each link in the base at joint positions [rad]."""
    import yourdfpy

    model = yourdfpy.URDF.load(path)
    model.update_cfg({f"A{index + 1}": value for index, value in enumerate(q)})
    return {name: model.get_transform(name, "base").tolist() for name in model.link_map}


if __name__ == "__main__":
    usd, urdf, joints = sys.argv[1:]
    print(
        json.dumps({"usd": read_usd(usd), "urdf": read_urdf(urdf, [float(one) for one in joints.split(",")])})
    )
