"""What a user of reinforcement learning makes refuses what it cannot mean, as all other values do."""

from __future__ import annotations

import pytest

pytest.importorskip("gymnasium")

from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.deploy import DeploySettings, circle
from heptarm.rl.deploy_contact import ContactSettings
from heptarm.rl.env import ContactEnv, ReachEnv
from heptarm.rl.pilot import PolicyGuard
from heptarm.rl.policy import shipped
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.randomisation import Randomisation
from heptarm.rl.task import ReachTask
from tests.bad_values import Call, call_of, wrong

MADE = (
    ReachTask,
    PegInHole,
    PolicyGuard,
    DeploySettings,
    ContactSettings,
    BatchSettings,
    Randomisation,
    ReachEnv,
    ContactEnv,
    circle,
    shipped,
)


CALLS = [call_of(made.__name__, made) for made in MADE]


@pytest.mark.parametrize("call", CALLS, ids=[call.name for call in CALLS])
def test_what_a_parameter_cannot_mean_is_refused(call: Call) -> None:
    call({})
    found = list(wrong(call))
    assert not found, "\n".join(found)
