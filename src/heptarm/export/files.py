"""`export_model`: the model of an arm, its tool and its scene as a file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from heptarm.errors import CommandRejected
from heptarm.export.tree import TreeBody, TreeShape, tree_of
from heptarm.export.usd import usd
from heptarm.export.xml_formats import mjcf, sdf, urdf
from heptarm.values.checks import flag, instance, shown
from heptarm.values.files import path_of, refuse_existing, unwritable
from heptarm.values.fitted_arm import FittedArm
from heptarm.values.robot import robot as model_of
from heptarm.values.tool import Tool

#: Formats by the ending of the file.
FORMATS = {".urdf": "urdf", ".sdf": "sdf", ".xml": "mjcf", ".mjcf": "mjcf", ".usda": "usd"}
_XML = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}


def export_model(
    path: str | Path,
    *,
    robot: str = "iiwa14",
    tool: Tool | None = None,
    scene: str = "",
    fitted: FittedArm | None = None,
    overwrite: bool = False,
) -> Path:
    """Write the model of an arm with its flange, its tool and its scene for another program.

    The file has frames, masses, inertias, limits and shapes of the virtual cabinet. The root is `base`, the links are
    `link_0` to `link_7`, the joints `A1` to `A7`, then come `flange`, the tool and its frames as NAME_FRAME, and
    the bodies of the scene as scene_NAME. URDF, SDF and MJCF have their meshes in the folder NAME-meshes beside the
    file; USD has them inside.

    Args:
        path: the file; its ending chooses the format: .urdf, .sdf (1.8), .xml or .mjcf (MuJoCo), .usda (UsdPhysics).
        robot: "iiwa7", "iiwa14", "med7" or "med14", with a media flange "iiwa14+touch".
        tool: on the flange, with its load data, shapes and frames; None: none.
        scene: a ready scene or a file (MJCF); empty: none. Height fields are left out.
        fitted: a measured arm of this robot, whose friction (viscous and Coulomb) and rotors the joints have, as far as
            the format knows them: URDF has no rotors, USD neither; None: those of the simulator.
        overwrite: replace files that exist.

    Returns:
        The file.

    Raises:
        CommandRejected: another ending, no such robot or scene, a scene that the format cannot express, a file that
            exists or cannot be written.
        MissingExtra: the packages of the simulator are not installed.
    """
    where, model = path_of(path), model_of(robot)
    if tool is not None:
        instance(tool, Tool, "tool")
    instance(scene, str, "scene")
    if fitted is not None and instance(fitted, FittedArm, "fitted").model.base_name != model.base_name:
        raise CommandRejected(
            f"fitted must be an arm of the {model.name}, got one of the {fitted.robot}",
            parameter="fitted",
            value=fitted.robot,
            hint="export the robot that was measured",
        )
    flag(overwrite, "overwrite")
    kind = FORMATS.get(where.suffix.lower())
    if kind is None:
        endings = ", ".join(FORMATS)
        raise CommandRejected(
            f"path must end in one of {endings}, got {shown(where.name)}",
            parameter="path",
            value=str(where),
            allowed=endings,
        )
    refuse_existing(where, overwrite=overwrite)
    bodies = tree_of(model, tool=tool, scene=scene, fitted=fitted)
    name = re.sub(r"\W", "_", model.name, flags=re.ASCII)
    folder = where.with_name(f"{where.stem}-meshes")
    try:
        where.parent.mkdir(parents=True, exist_ok=True)
        if kind == "usd":
            where.write_text(usd(name, bodies), encoding="utf-8")
        else:
            _write_meshes(folder, bodies)
            where.write_text(_XML[kind](name, bodies, folder.name), encoding="utf-8")
    except OSError as error:
        raise unwritable(where, error) from error
    return where


def _write_meshes(folder: Path, bodies: Sequence[TreeBody]) -> None:
    """Write the meshes of a tree as files of the format OBJ."""
    meshes = {shape.name: shape for body in bodies for shape in body.shapes if shape.kind == "mesh"}
    for name, mesh in meshes.items():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.obj").write_text(_obj(mesh), encoding="utf-8")


def _obj(mesh: TreeShape) -> str:
    vertices = (f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in mesh.vertices.tolist())
    faces = (f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist())
    return "\n".join((*vertices, *faces, ""))
