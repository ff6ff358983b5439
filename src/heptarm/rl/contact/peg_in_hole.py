"""The peg-in-hole task: put a round peg into a hole, see `heptarm.rl.contact.insertion`.

The scene has the dimensions of the shipped scene `peg-in-hole`: a peg of 20 mm, a hole wider by `clearance`. A round
peg needs no turn about its own axis. It is there when it is `depth` deep in the hole at the end, within `radius`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from heptarm.rl.contact.insertion import InsertTask

#: Of the peg and the walls of the hole [m].
_RADIUS, _WALL = 0.01, 0.015
#: Radius of the peg's edge [m].
_EDGE = 0.4e-3

# The peg is only drawn; what touches are 16 rods around it. They round its edge, whose moment shows on which side the
# end is supported; and the engine computes contacts of rods with boxes exactly, those of a cylinder by steps that
# rarely ends at a wrong normal.
_SCENE = """<mujoco>
  <default>
    <default class="steel"><geom solref="0.005 1" friction="0.2 0.002 0.0001"/></default>
    <default class="drawn"><geom contype="0" conaffinity="0"/></default>
  </default>
  <worldbody>
    <body name="tool">
      <geom name="gripper" class="drawn" type="box" size="0.03 0.055 0.03" pos="0 0 0.05" mass="1"/>
      <site name="tip" pos="0 0 0.225"/>
      <body name="peg" pos="0 0 0.225" childclass="steel">
        <geom name="peg" class="drawn" type="cylinder" size="{radius} 0.0248" pos="0 0 -0.0252" mass="0.19"/>
        <replicate count="16" euler="0 0 22.5">
          <geom type="capsule" size="{edge}" fromto="{ring} 0 -{edge} {ring} 0 -0.0496" mass="0"/>
        </replicate>
      </body>
    </body>
    <body name="hole" mocap="true" childclass="steel">
      <replicate count="8" euler="0 0 45">
        <geom type="box" size="{wall} 0.0165 0.02" pos="{middle} 0 0.02"/>
      </replicate>
    </body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class PegInHole(InsertTask):
    """Insert a round peg into a hole; its numbers are those of `InsertTask`."""

    name: ClassVar[str] = "peg-in-hole"

    def scene(self) -> str:
        """Peg and hole."""
        return _SCENE.format(
            radius=_RADIUS,
            edge=_EDGE,
            ring=_RADIUS - _EDGE,
            wall=_WALL,
            middle=_RADIUS + 0.5 * self.clearance + _WALL,
        )
