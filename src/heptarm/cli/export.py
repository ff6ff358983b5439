"""`heptarm export`: the model of an arm with its tool and its scene, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.cli.options import Json, Model, Overwrite
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.export.files import FORMATS, export_model
from heptarm.io.targets import saved_target
from heptarm.values.fitted_arm import load_fitted
from heptarm.values.tool import Tool

_ENDINGS = {"urdf": ".urdf", "mjcf": ".xml", "sdf": ".sdf", "usd": ".usda"}


def export(
    form: Annotated[
        Literal["urdf", "mjcf", "sdf", "usd"],
        Parameter(help="URDF for ROS, MJCF for MuJoCo, SDF for Gazebo, USD with UsdPhysics."),
    ],
    out: Annotated[
        Path | None, Parameter(help="File to write. Default: MODEL with the ending of the format.")
    ] = None,
    /,
    *,
    model: Annotated[Model, Parameter(help="Robot, with its media flange.")] = "iiwa14",
    scene: Annotated[str, Parameter(help="A ready scene, or a file (MJCF). Default: none.")] = "",
    tool: Annotated[
        str,
        Parameter(help="A tool of the saved target, with its load data, shapes and frames. Default: none."),
    ] = "",
    target: Annotated[str, Parameter(help="The saved target that has the tool (heptarm targets).")] = "",
    fitted: Annotated[
        Path | None,
        Parameter(
            help="File of heptarm calibrate arm: friction and rotors of your arm. Default: those of the simulator."
        ),
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Export the arm with its flange, its tool and its scene as URDF, MJCF, SDF or USD.

    For example:

        heptarm export urdf

        heptarm export mjcf cell.xml --model iiwa14+touch --scene two-arms --target lab1 --tool gripper
    """
    path = Path(f"{model}{_ENDINGS[form]}") if out is None else out
    if FORMATS.get(path.suffix.lower()) != form:
        endings = ", ".join(ending for ending, other in FORMATS.items() if other == form)
        raise CommandRejected(
            f"out must end in {endings} for {form}, got {path.name!r}", parameter="out", value=str(path)
        )
    mounted = _tool(tool, target) if tool else None
    arm = None if fitted is None else load_fitted(fitted)
    written = export_model(path, robot=model, tool=mounted, scene=scene, fitted=arm, overwrite=overwrite)
    if as_json:
        emit({"file": str(written), "bytes": written.stat().st_size})
    else:
        print(written)
    return 0


def _tool(name: str, target: str) -> Tool:
    """A tool of a saved target.

    Raises:
        CommandRejected: there is no such target, or it has no such tool.
    """
    saved = saved_target(target) if target else None
    if saved is None:
        raise CommandRejected(
            f"target must be a saved one that has the tool {name!r}, got {target!r}",
            parameter="target",
            value=target,
            hint="heptarm targets lists them; heptarm calibrate load --save makes a tool of one",
        )
    known = {tool.name: tool for tool in saved.tools}
    if name not in known:
        listed = ", ".join(known) or "none"
        raise CommandRejected(
            f"tool must be one of the target {target}: {listed}; got {name!r}",
            parameter="tool",
            value=name,
            allowed=listed,
        )
    return known[name]
