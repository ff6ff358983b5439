"""The plug task: put a plug into a socket until its latches snap, see `heptarm.rl.contact.insertion`.

The plug is rectangular, with a sprung latch on each side. They are squeezed by the lip of the socket, which takes some
10 N, and snap out behind it. The plug is there when it is `depth` deep, within `radius`, and its latches are out.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from math import radians
from typing import ClassVar

import numpy as np

from heptarm.rl.contact.insertion import InsertTask
from heptarm.rl.contact.task import Moment, quantity
from heptarm.values.checks import Array

#: Half width and half thickness of the plug, depth of the lip, thickness of the walls [m].
_HALF, _THIN, _LIP, _WALL = 0.008, 0.005, 0.008, 0.01
#: A latch stands out so far; it is out while it is squeezed by no more than this [m]. What one that is squeezed adds.
_OUT, _SQUEEZED, _UNLATCHED = 1.2e-3, 0.4e-3, 3e-3

_SCENE = """<mujoco>
  <default>
    <default class="plastic"><geom solref="0.005 1" friction="0.2 0.002 0.0001"/></default>
    <default class="latch"><joint type="slide" range="-0.0016 0" limited="true" damping="1" stiffness="2500"
      springref="0.0004" armature="0.01" solreflimit="0.005 1"/></default>
  </default>
  <worldbody>
    <body name="tool" childclass="plastic">
      <geom name="holder" type="box" size="0.02 0.03 0.03" pos="0 0 0.05" mass="0.8" contype="0" conaffinity="0"/>
      <geom name="plug" type="box" size="{half} {thin} 0.02" pos="0 0 0.16" mass="0.05"/>
      <site name="tip" pos="0 0 0.18"/>
      <body name="left" pos="{latch} 0 0.174" childclass="latch">
        <joint name="left" axis="1 0 0"/>
        <geom class="plastic" type="sphere" size="0.002" mass="0.002"/>
      </body>
      <body name="right" pos="-{latch} 0 0.174" childclass="latch">
        <joint name="right" axis="-1 0 0"/>
        <geom class="plastic" type="sphere" size="0.002" mass="0.002"/>
      </body>
    </body>
    <body name="socket" mocap="true" childclass="plastic">
      <geom type="box" size="{wall} 0.02 {lip}" pos="{at_lip} 0 {lip}"/>
      <geom type="box" size="{wall} 0.02 {lip}" pos="-{at_lip} 0 {lip}"/>
      <geom type="box" size="{wall} 0.02 0.008" pos="{behind} 0 {under}"/>
      <geom type="box" size="{wall} 0.02 0.008" pos="-{behind} 0 {under}"/>
      <geom type="box" size="{half} {wall} 0.012" pos="0 {beside} 0.012"/>
      <geom type="box" size="{half} {wall} 0.012" pos="0 -{beside} 0.012"/>
      <geom type="box" size="0.02 0.02 0.005" pos="0 0 {bottom}"/>
    </body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class PlugInsert(InsertTask):
    """Insert a plug that snaps in; its numbers are those of `InsertTask`."""

    name: ClassVar[str] = "plug-insert"

    _: KW_ONLY
    clearance: float = quantity(0.8e-3, "m")
    depth: float = quantity(0.016, "m")
    place: float = quantity(2e-3, "m")
    tilt: float = quantity(radians(1.0), "rad")
    force: float = quantity(25.0, "N")
    leash: float = quantity(0.016, "m")

    def scene(self) -> str:
        """Plug and socket."""
        play = 0.5 * self.clearance
        return _SCENE.format(
            half=_HALF,
            thin=_THIN,
            latch=_HALF + _OUT - 0.002,
            lip=0.5 * _LIP,
            wall=_WALL,
            at_lip=_HALF + play + _WALL,
            behind=_HALF + play + 2.0 * _OUT + _WALL,
            under=_LIP + 0.008,
            beside=_THIN + play + _WALL,
            bottom=self.depth + 0.5e-3 + 0.005,
        )

    def bodies(self, target: Array) -> dict[str, Array]:
        """The socket."""
        return {"socket": target}

    def missing(self, now: Moment) -> Array:
        """Depth that is missing, and more while a latch is not out."""
        squeezed = np.minimum(now.joints["left"], now.joints["right"]) < -_SQUEEZED
        return InsertTask.missing(self, now) + np.where(squeezed, _UNLATCHED, 0.0)
