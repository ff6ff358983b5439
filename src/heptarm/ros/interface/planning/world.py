"""The bodies around the arm of a node, as topics and services report them.

A change happens to a copy, which the world becomes when all of it has succeeded. So a refused message changes nothing.
A search that runs keeps the world with which it began; an arm that moves along a path watches the world as it is.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeAlias

from heptarm.errors import CommandRejected
from heptarm.ros.node.driver import Driver
from heptarm.sim.collision import CollisionModel
from heptarm.values.checks import Array
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import ORIGIN, Shape
from heptarm.values.world import Color

Part: TypeAlias = Shape | Mesh


@dataclass(frozen=True, slots=True)
class SceneBody:
    """A body that somebody has added to the world of a node.

    Attributes:
        parts: its shapes, in the frame of the body.
        pose: of the body, in the base; of one that the arm holds, in the flange frame.
        is_held: whether the arm holds it.
        cloud: of one that is a cloud of points: these, in its frame, shape (n, 3) [m]; it has no parts.
    """

    parts: tuple[Part, ...]
    pose: Pose
    is_held: bool = False
    cloud: Array | None = None


class WorldDraft:
    """A copy of a world, to be changed.

    Args:
        model: of collisions; it is changed.
        bodies: those that were added.
        colors: of bodies, also of those that will be added.

    Attributes:
        model: see above.
        bodies: see above.
        colors: see above.
    """

    def __init__(
        self, model: CollisionModel, bodies: Mapping[str, SceneBody], colors: Mapping[str, Color]
    ) -> None:
        self.model, self.bodies, self.colors = model, dict(bodies), dict(colors)

    def add(self, name: str, body: SceneBody) -> None:
        """Add a body, in place of the one of that name.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        if name in self.bodies:
            self.model.remove(name)
        place, color = ORIGIN if body.is_held else body.pose, self.colors.get(name)
        if body.cloud is None:
            self.model.add(name, body.parts, at=place, color=color)
        else:
            self.model.add_points(body.cloud, name=name, at=place, color=color)
        self._put(name, body)

    def remove(self, name: str) -> None:
        """Remove a body.

        Raises:
            CommandRejected: none of that name was added.
        """
        self.body(name)
        self.model.remove(name)
        del self.bodies[name]

    def move(self, name: str, pose: Pose) -> None:
        """Put a body somewhere in the base; the arm holds it no more."""
        self._put(name, replace(self.body(name), pose=pose, is_held=False))

    def hold(self, name: str, pose: Pose) -> None:
        """Let the arm hold a body at a pose in the flange frame."""
        self._put(name, replace(self.body(name), pose=pose, is_held=True))

    def paint(self, name: str, color: Color) -> None:
        """Give a body a colour, or one that will be added."""
        self.colors[name] = color
        if name in self.bodies:
            self.model.set_color(name, color)

    def body(self, name: str) -> SceneBody:
        """Look up a body.

        Raises:
            CommandRejected: none of that name was added.
        """
        if name not in self.bodies:
            listed = ", ".join(self.bodies) or "none"
            raise CommandRejected(
                f"id must be that of a body that was added, one of {listed}; got {name!r}",
                parameter="id",
                value=name,
                allowed=listed,
            )
        return self.bodies[name]

    def _put(self, name: str, body: SceneBody) -> None:
        (self.model.hold if body.is_held else self.model.place)(name, body.pose)
        self.bodies[name] = body


class NodeWorld:
    """The world around the arm of a node; it begins with the scene of the parameters.

    Args:
        driver: of the arm.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._lock = threading.RLock()
        self._model: CollisionModel | None = None
        self._bodies: Mapping[str, SceneBody] = MappingProxyType({})
        self._colors: Mapping[str, Color] = MappingProxyType({})

    @property
    def model(self) -> CollisionModel:
        """The world, which changes; see `draft` for a copy.

        Raises:
            CommandRejected: there is no such scene.
            MissingExtra: the models of bodies are not installed.
        """
        with self._lock:
            if self._model is None:
                values = self._driver.configuration.values
                self._model = CollisionModel(
                    self._driver.arm.robot.name,
                    scene=values["planning.scene"],
                    margin=values["planning.margin"],
                )
                self._model.show()
            return self._model

    @property
    def bodies(self) -> Mapping[str, SceneBody]:
        """Bodies that were added, by name."""
        return self._bodies

    @property
    def colors(self) -> Mapping[str, Color]:
        """Colours that were chosen for bodies, by name."""
        return self._colors

    def draft(self) -> WorldDraft:
        """A copy, to be changed; see `changing` for one that becomes the world.

        Raises:
            HeptarmError: as `model`.
        """
        with self._lock:
            return WorldDraft(self.model.carrying(None), self._bodies, self._colors)

    @contextlib.contextmanager
    def changing(self) -> Iterator[WorldDraft]:
        """A copy that becomes the world at the end, unless an error is raised.

        Raises:
            HeptarmError: as `model`.
        """
        with self._lock:
            draft = self.draft()
            yield draft
            self.model.become(draft.model)
            self._bodies, self._colors = MappingProxyType(draft.bodies), MappingProxyType(draft.colors)
