"""The arm: everything that a program does with the robot goes through it."""

from __future__ import annotations

from heptarm.arm.verbs import ArmVerbs
from heptarm.skills import collision_guard as guarding
from heptarm.skills import replay as replaying
from heptarm.skills import teaching
from heptarm.skills import touch as touching


class Arm(ArmVerbs):
    """A connected arm; made by `connect`. Its methods may be called from any thread.

    In a `with` block it is left at rest, however the block ends.

    Its verbs are those of `ArmVerbs`. Here are the skills among its methods: functions of heptarm.skills, which take
    the arm first and use only its verbs.
    """

    touch = touching.touch
    touch_twice = touching.touch_twice
    wait_for_taps = touching.wait_for_taps
    on_taps = touching.on_taps
    collision_guard = guarding.collision_guard
    guarded = guarding.guarded
    guide_precisely = teaching.guide_precisely
    teach = teaching.teach
    replay = replaying.replay
