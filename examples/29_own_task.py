"""A task of your own, in one file: press with 8 N on a plate whose height is known to 5 mm, and hold it.

29_own_task.py [STEPS [POLICY.npz]]     trains for so many environment steps; 0 by default: only its teacher is tried
"""

import sys
from dataclasses import dataclass
from typing import ClassVar

import gymnasium
import numpy as np

import heptarm.rl
from heptarm.rl.contact.task import ContactTask, Moment, quantity
from heptarm.rl.evaluate import evaluate
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.simulate import simulate
from heptarm.values.checks import Array

SCENE = """<mujoco>
  <worldbody>
    <body name="tool">
      <geom type="capsule" size="0.008" fromto="0 0 0.02 0 0 0.142" mass="0.3"/>
      <site name="tip" pos="0 0 0.15"/>
    </body>
    <body name="plate" mocap="true"><geom type="box" size="0.1 0.1 0.01" pos="0 0 0.01" solref="0.01 1"/></body>
  </worldbody>
</mujoco>"""


@dataclass(frozen=True, slots=True)
class PressPlate(ContactTask):
    """The frame of the task is where the plate is presumed, z into it; the target is how much deeper it is [m]."""

    name: ClassVar[str] = "press-plate"
    axes: ClassVar[tuple[int, ...]] = (2,)  # the policy moves and feels z alone
    has_teacher: ClassVar[bool] = True
    steps: int = 60
    force: float = quantity(8.0, "N")

    def scene(self) -> str:
        return SCENE

    @property
    def box(self) -> tuple[Array, Array]:  # of the set-point
        return np.array([0, 0, -0.03, 0, 0, 0]), np.array([0, 0, 0.02, 0, 0, 0])

    def targets(self, random: np.random.Generator, count: int) -> Array:
        return random.uniform(-0.005, 0.005, (count, 1))

    def starts(self, random: np.random.Generator, count: int) -> Array:
        return np.tile([0, 0, -0.015, 0, 0, 0.0], (count, 1))

    def bodies(self, target: Array) -> dict[str, Array]:
        return {"plate": target * [[0, 0, 1, 0, 0, 0]]}

    def missing(self, now: Moment) -> Array:  # at most `radius` at the end is success: 1.5 N
        return np.abs(self.force + now.wrench[..., 2]) * 1e-3

    def reward(self, now: Moment) -> Array:
        return 0.5 - np.minimum(self.missing(now) / 5e-3, 2.0)

    def teach(self, now: Moment) -> Array:
        deeper = self.force / self.stiffness * (now.pose[..., 2:3] > now.target - 1e-3)
        return self.steer(now, now.target + deeper + 0.0 * now.pose)


heptarm.rl.register(PressPlate)
if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    arms = simulate(PressPlate(), BatchSettings(envs=8, starts="together"))
    for _ in range(arms.task.steps - 1):
        step = arms.step(arms.teach())
    print(f"the teacher presses with {step.force.round(1)} N")
    if steps:
        from heptarm.rl.train.train import Recipe, train

        trained = train(Recipe.of(PressPlate()), steps=steps, out=sys.argv[2] if len(sys.argv) > 2 else None)
        print(evaluate(trained.policy, 100).summary())
    print(gymnasium.make("heptarm/PressPlate-v0").reset(seed=1)[0].shape, "numbers in an observation")
