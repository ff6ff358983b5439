"""What the handlers of topics, services and actions work with."""

from __future__ import annotations

import contextlib

from heptarm.arm.arm import Arm
from heptarm.errors import NotReady, Timeout
from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.interface.pictures import ImageFeed
from heptarm.ros.interface.planning.world import NodeWorld
from heptarm.ros.interface.presets.iiwa_settings import IiwaStackSettings
from heptarm.ros.node.driver import Driver
from heptarm.skills.gripper import TwoSignalGripper
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.tool import Workpiece

#: How long a request waits for a motion to end before it is refused [s].
_REST_TIMEOUT = 2.0


class NodeContext:
    """The driver of a node, its ROS, and what handlers keep between requests.

    Args:
        driver: of the arm.
        ros: types and time of the node's ROS.

    Attributes:
        driver: see above.
        ros: see above.
        workpiece: attached by a service, or the name of its template; None: none is.
        taught: trajectories recorded by the action `teach`, by name.
        gripper: of the action `gripper_cmd`; None: it has had no goal yet.
        gripper_goal: number of its newest goal; 0: none.
        iiwa_stack: what the services with names of iiwa_stack have set.
        world: the bodies around the arm.
        images: pictures of the camera whose topic is remapped to `image`.
    """

    def __init__(self, driver: Driver, ros: RosAdapter) -> None:
        self.driver = driver
        self.ros = ros
        self.workpiece: Workpiece | str | None = None
        self.taught: dict[str, Trajectory] = {}
        self.gripper: TwoSignalGripper | None = None
        self.gripper_goal = 0
        self.iiwa_stack = IiwaStackSettings()
        self.world = NodeWorld(driver)
        self.images = ImageFeed()
        self._mode = contextlib.ExitStack()

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.driver.arm

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return list(self.driver.configuration.joints)

    @property
    def base(self) -> str:
        """Name of the base frame."""
        return self.driver.configuration.frame("base")

    def set_mode(self, mode: Mode) -> None:
        """Set the control mode of the following motions; it replaces the previous one.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self.wait_for_rest()
        self._mode.close()
        self._mode.enter_context(self.arm.using(mode))

    def check_active(self) -> None:
        """Refuse a request of an inactive node.

        Raises:
            NotReady: the node is not active.
        """
        if not self.driver.active:
            raise NotReady("the node is not active", hint="activate it")

    def wait_for_rest(self) -> None:
        """Wait until no motion runs; a servo motion ends a moment after its last target.

        Raises:
            NotReady: the node is not active, or a motion does not end.
        """
        self.check_active()
        try:
            self.arm.wait_until(
                lambda state: not state.motion or not state.motion.active, timeout=_REST_TIMEOUT
            )
        except Timeout:
            raise NotReady("a motion is running", hint="stop it first") from None
