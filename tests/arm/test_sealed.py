"""A mistyped setting is an error on every object that a program holds, and nothing is set."""

from __future__ import annotations

import enum
import importlib
import inspect
import typing
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import laws
from heptarm.arm.devices.operator import Operator
from heptarm.fri import LawTrial
from heptarm.skills.gripper import TwoSignalGripper
from heptarm.values.sealed import Sealed, meant
from tests.arm.peer import Peer

#: Packages whose classes users hold objects of.
_PACKAGES = ("heptarm", "heptarm.fri", "heptarm.laws", "heptarm.devices", "heptarm.skills", "heptarm.model")


def refused(thing: object, name: str) -> ha.UnknownSetting:
    """The error of a setting that must not be accepted; a program may also catch it as Python's own."""
    before = dict(getattr(thing, "__dict__", {}))
    with pytest.raises(AttributeError) as caught:
        setattr(thing, name, 0.05)
    assert isinstance(caught.value, ha.UnknownSetting) and caught.value.parameter == name
    assert getattr(thing, "__dict__", {}) == before
    return caught.value


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("Speed", "did you mean 'speed'?"),
        ("workspaces", "did you mean 'workspace'?"),
        ("colision_check", "did you mean 'collision_check'?"),
        ("sped", "did you mean 'speed'?"),
        ("watchdog", "settings are collision_check, name, speed, workspace"),
        ("state", "settings are"),
        ("stop", "settings are"),
    ],
)
def test_a_mistyped_setting_of_the_arm_is_refused(peer: Peer, name: str, hint: str) -> None:
    with peer.arm() as arm:
        assert hint in str(refused(arm, name))
        assert arm.speed == 1.0
        arm.speed = 0.5
        assert arm.speed == 0.5


def test_what_cannot_be_set_is_not_called_unknown(peer: Peer) -> None:
    with peer.arm() as arm:
        assert refused(arm, "state").text == "state of Arm cannot be set"
        assert refused(arm, "Speed").text == "Arm has no setting 'Speed'"


def test_objects_made_by_an_arm_refuse_mistyped_settings(peer: Peer, tmp_path: Path) -> None:
    with peer.arm() as arm:
        for kind in ("joint", "pose", "lin", "velocity", "twist"):
            servo = arm.servo(kind, rate=100)
            for name in ("Period", "watchdogs", "q", "set", "stats", "what"):
                refused(servo, name)
            assert "cannot be set" in refused(servo, "period").text and servo.period == 0.01
        recorder = arm.record(tmp_path / "run.mcap")
        for name in ("rate", "pth", "path", "states", "lost"):
            refused(recorder, name)
        refused(arm.io, "Led")
        for thing in (arm.pad, arm.io, arm.states(), Operator(typing.cast(typing.Any, None))):
            refused(thing, "speeed")


def test_an_fri_session_refuses_mistyped_settings(peer: Peer) -> None:
    peer.changes["capabilities"] = ("fri_monitor",)
    with peer.arm() as arm:
        session = arm.fri("monitor")
        for name in ("Command", "command", "params", "q", "policy"):
            refused(session, name)


def test_a_trial_of_a_law_names_the_parameter_that_was_meant() -> None:
    trial = LawTrial(laws.joint_impedance())
    refused(trial, "stiffness")
    trial.t = 1.0
    with pytest.raises(ha.UnknownSetting, match="did you mean 'damping'"):
        trial.params.dampin = np.ones(7)


class HeldGripper(TwoSignalGripper):
    """A user's own gripper, which declares its settings."""

    force: float

    def __init__(self) -> None:
        self.force = 20.0


def test_a_users_subclass_declares_its_own_settings() -> None:
    gripper = HeldGripper()
    gripper.force = 30.0
    assert gripper.force == 30.0
    assert "did you mean 'force'?" in str(refused(gripper, "Force"))
    refused(gripper, "setle")


class Final(Sealed):
    """Attributes that are set once, or belong to the class."""

    once: typing.Final[int]
    of_class: typing.ClassVar[int] = 3

    def __init__(self) -> None:
        self.once = 1


def test_final_attributes_are_set_once() -> None:
    thing = Final()
    refused(thing, "once")
    refused(thing, "of_class")
    assert thing.once == 1


def test_nothing_is_meant_by_a_name_like_no_other() -> None:
    assert meant("qwertz", ("speed", "name")) == ""


def test_no_public_object_takes_unknown_attributes() -> None:
    """All public classes, so that a new one is not forgotten."""
    open_ones = []
    for package in _PACKAGES:
        module = importlib.import_module(package)
        for name in getattr(module, "__all__", dir(module)):
            kind = getattr(module, name)
            if not inspect.isclass(kind) or issubclass(kind, (enum.Enum, BaseException, tuple)):
                continue
            if not kind.__module__.startswith("heptarm") or getattr(kind, "_is_protocol", False):
                continue
            if kind.__setattr__ is object.__setattr__ and kind.__dictoffset__:
                open_ones.append(kind.__qualname__)
    assert open_ones == []
