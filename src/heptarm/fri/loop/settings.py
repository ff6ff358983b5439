"""Settings of an FRI loop: one frozen value, checked where it is made and sent whole to the process of the loop.

A new setting is a field here, with its keyword and its check, and the place where it acts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypedDict

from heptarm.errors import CommandRejected, ShapeError
from heptarm.fri.guard.fallback import Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.loop.compiled import WITH_MEMORY, CompiledLaw, arity
from heptarm.fri.loop.law_interface import Floats, Given, Initial, flat
from heptarm.fri.loop.parameters import Param, merged, rates
from heptarm.fri.protocol.version import Version
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.checks import callback, flag, instance, integer, within
from heptarm.values.condition.collision import CollisionGuard
from heptarm.values.robot import Body, RobotModel, robot

#: `law(state, out, params)`, or `law(state, out, params, memory)`.
Law = Callable[..., object]
#: Longest `busy_poll` [s]. It counts before and after the moment at which a message is due: half of the shortest period
#: in all, so that Linux does not hold up the loop as a runaway realtime thread.
BUSY_POLL = 0.25e-3


class LoopKeywords(TypedDict, total=False):
    """The fields of `LoopSettings` as keywords, for type checkers; of an arm the robot is known."""

    version: str | None
    load: Body | None
    limits: Limits | None
    pose_limits: PoseLimits | None
    policy: Policy | None
    law: Law | CompiledLaw | None
    params: Mapping[str, Initial] | None
    memory: Mapping[str, Given] | None
    collision: CollisionGuard | None
    history: int
    realtime: bool
    cpu: int | None
    busy_poll: float


class ClientKeywords(LoopKeywords, total=False):
    """All fields of `LoopSettings` as keywords."""

    model: str | RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """Settings of a loop.

    Attributes:
        version: FRI release such as "1.15"; None recognises it from the first datagram.
        model: robot, or its name, for the limits.
        load: on the flange, for the guard of torques, which computes with the robot's inertia; None: none.
        limits: limits of joint commands; None for limits slightly inside the robot's.
        pose_limits: limits of pose commands; None for 0.25 m/s and 1 rad/s.
        policy: behaviour without fresh commands; None for the default.
        law: `law(state, out, params)` or `law(state, out, params, memory)`, called in the loop's process in every cycle
            of COMMANDING_ACTIVE; the guard limits its output. With `heptarm.law` or `heptarm.law_from` the loop calls
            it without Python. None: commands come from `command`.
        params: parameters of the law, numbers and arrays by name, or declarations with `heptarm.param`.
        memory: what the law keeps from call to call, numbers and arrays by name with their initial values.
        collision: bands of the external torques; at a torque outside its band the arm brakes at once, and the client
            commands nothing more: `collision` names the joint. None: no such bands.
        history: number of states that are kept.
        realtime: request real-time priority and locked memory.
        cpu: processor of the loop; None for any.
        busy_poll: how long before a message is due the loop polls for it instead of sleeping [s], at most 0.25 ms;
            0.2 ms is longer than most machines take to wake a thread. The answer then waits for no thread to wake, and
            a processor is busy meanwhile. 0: never.

    Raises:
        ShapeError: one is of another type.
        CommandRejected: one is outside its range.
    """

    version: str | None = None
    model: str | RobotModel = "iiwa14"
    load: Body | None = None
    limits: Limits | None = None
    pose_limits: PoseLimits | None = None
    policy: Policy | None = None
    law: Law | CompiledLaw | None = None
    params: Mapping[str, Initial] | None = None
    memory: Mapping[str, Given] | None = None
    collision: CollisionGuard | None = None
    history: int = 2048
    realtime: bool = True
    cpu: int | None = None
    busy_poll: float = 0.0

    def __post_init__(self) -> None:
        if self.version is not None:
            try:
                Version.of(instance(self.version, str, "version"))
            except ValueError as error:
                if isinstance(error, CommandRejected):
                    raise
                raise CommandRejected(str(error), parameter="version", value=self.version) from None
        if not isinstance(self.model, str):
            instance(self.model, RobotModel, "model")
        for value, kind, name in (
            (self.load, Body, "load"),
            (self.limits, Limits, "limits"),
            (self.pose_limits, PoseLimits, "pose_limits"),
            (self.policy, Policy, "policy"),
            (self.collision, CollisionGuard, "collision"),
        ):
            if value is not None:
                instance(value, kind, name)
        if self.law is not None and not isinstance(self.law, CompiledLaw):
            callback(self.law, "law")
        if self.params is not None:
            flat(self.params, "params")
        if self.memory is not None:
            flat(self.memory, "memory")
            if not isinstance(self.law, CompiledLaw) and (self.law is None or arity(self.law) < WITH_MEMORY):
                raise ShapeError(
                    "memory needs a law with four arguments",
                    parameter="memory",
                    hint="write it as law(s, out, p, m): m has what memory= names",
                )
        integer(self.history, "history", 16, 1 << 20)
        flag(self.realtime, "realtime")
        if self.cpu is not None:
            integer(self.cpu, "cpu", 0, 65535)
        within(self.busy_poll, "busy_poll", 0.0, BUSY_POLL, unit="s")
        object.__setattr__(self, "model", self.arm)
        _ = self.declared  # raises for a value outside its range

    @property
    def arm(self) -> RobotModel:
        """The robot."""
        return robot(self.model) if isinstance(self.model, str) else self.model

    @property
    def wire(self) -> Version | None:
        """Wire format; None: that of the first datagram."""
        return None if self.version is None else Version.of(self.version)

    @property
    def declared(self) -> dict[str, Param]:
        """Declarations of the law's parameters; those of a compiled law may depend on the robot."""
        known = self.law.parameters(self.arm) if isinstance(self.law, CompiledLaw) else {}
        return merged(known, self.params)

    @property
    def law_params(self) -> tuple[Floats, dict[str, tuple[tuple[int, ...], int]]]:
        """Parameters of the law, flattened, and their schema."""
        return flat(self.declared, "params")

    @property
    def law_rates(self) -> Floats:
        """Largest change of each parameter in a second."""
        return rates(self.declared)

    @property
    def bodies(self) -> Floats:
        """Links, load and motors of the robot, for the guard of torques: `rigid_bodies`."""
        return rigid_bodies(self.arm, self.load, rotor=ROTOR)

    @property
    def law_memory(self) -> tuple[Floats, dict[str, tuple[tuple[int, ...], int]]]:
        """Initial memory of the law, flattened, and its schema."""
        known: Mapping[str, Given] = self.law.memory if isinstance(self.law, CompiledLaw) else {}
        return flat({**known, **(self.memory or {})}, "memory")

    @property
    def sizes(self) -> dict[str, int]:
        """Sizes of the shared memory: see `Layout`."""
        return {
            "history": self.history,
            "params": self.law_params[0].size,
            "memory": self.law_memory[0].size,
        }
