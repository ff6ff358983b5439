"""How the arm is drawn: heptarm's own meshes, or those of a folder. Nothing here touches the physics.

A model's file has both kinds of shapes: those that meet others, and meshes for the eye. The plant, the collision model
and the training have the first kind alone; viewers and films have both, and hide the first.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

#: MuJoCo's groups of shapes: drawn by default, and not.
DRAWN_GROUP, HIDDEN_GROUP = 2, 3
LINKS = tuple(f"link_{index}" for index in range(8))
#: Materials of the models, which a file of a mesh may name.
COLOURS = ("silver", "orange", "dark")
_FILE = re.compile(rf"(link_[0-7])(?:\.({'|'.join(COLOURS)}))?\.(?:stl|obj)", re.IGNORECASE)
#: A link is about as long as this, at least and at most [m].
_SIZES = (0.02, 2.0)


@dataclass(frozen=True, slots=True)
class ArmMeshes:
    """Meshes of the arm's links.

    Attributes:
        folder: with `link_0.stl` to `link_7.stl` (binary) or `.obj`, in metres, in the frames of the links that
            `iiwa14.xml` has. A link may have a file for each of its colours instead, such as `link_3.orange.obj`;
            without a colour it is silver. None: heptarm's own meshes.
    """

    folder: Path | None = None

    @staticmethod
    def of(text: str) -> ArmMeshes:
        """The meshes of a folder; "": heptarm's own.

        Raises:
            ValueError: there is no such folder, or files of links are missing or cannot be read.
        """
        if not text:
            return ArmMeshes()
        meshes = ArmMeshes(Path(text).expanduser())
        for path in meshes._files().values():
            _check(path)
        return meshes

    def dress(self, spec: mujoco.MjSpec) -> None:
        """Let a model's links look like this."""
        if self.folder is None:
            return
        _remove_meshes(spec)
        for (link, colour), path in self._files().items():
            _add_mesh(spec, spec.body(link), path, f"{link}.{colour}").material = colour

    def _files(self) -> dict[tuple[str, str], Path]:
        """File of each link and colour.

        Raises:
            ValueError: there is no such folder, or a link has none, or two for one colour.
        """
        assert self.folder is not None
        if not self.folder.is_dir():
            raise ValueError(
                f"meshes must be a folder with link_0.stl to link_7.stl, got {str(self.folder)!r}"
            )
        found: dict[tuple[str, str], Path] = {}
        for path in sorted(self.folder.iterdir()):
            match = _FILE.fullmatch(path.name)
            if match is None:
                continue
            finish = (match[1].lower(), (match[2] or COLOURS[0]).lower())
            if finish in found:
                raise ValueError(
                    f"meshes must have one file for a link and a colour, got {found[finish].name} and {path.name}; "
                    "remove one of them"
                )
            found[finish] = path
        missing = [link for link in LINKS if not any(link == known for known, _ in found)]
        if missing:
            raise ValueError(
                f"meshes must have a file for each link, such as {missing[0]}.stl or {missing[0]}.obj; "
                f"{self.folder} has none for {', '.join(missing)}"
            )
        return found


def undress(spec: mujoco.MjSpec) -> None:
    """Leave a model the shapes that meet others, and draw these."""
    _remove_meshes(spec)
    for geom in spec.geoms:
        if geom.group == HIDDEN_GROUP:
            geom.group = 0


def _remove_meshes(spec: mujoco.MjSpec) -> None:
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)


def _add_mesh(spec: mujoco.MjSpec, body: mujoco.MjsBody, path: Path, name: str) -> mujoco.MjsGeom:
    # as a surface that meets nothing: it need not enclose a volume, and may be flat
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name=name, file=str(path.resolve()), inertia=shell)
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, group=DRAWN_GROUP, contype=0, conaffinity=0, mass=0.0
    )


def _check(path: Path) -> None:
    """Read a mesh as MuJoCo does.

    Raises:
        ValueError: it cannot be read, or is not of a link's size in metres.
    """
    alone = mujoco.MjSpec()
    _add_mesh(alone, alone.worldbody, path, "mesh")
    try:
        vertices = alone.compile().mesh_vert
    except (ValueError, mujoco.FatalError) as error:
        reason = str(error).removeprefix("Error: ").splitlines()[0]
        raise ValueError(f"meshes: {path} must be a binary STL or an OBJ file: {reason}") from None
    size = float(np.ptp(vertices, axis=0).max())
    smallest, largest = _SIZES
    if not smallest <= size <= largest:
        raise ValueError(
            f"meshes: {path.name} must be a link in metres, {smallest:g} to {largest:g} m long, got {size:.3g} m; "
            "scale it, by 0.001 if it is in millimetres"
        )
