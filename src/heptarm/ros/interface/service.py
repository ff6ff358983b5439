"""A row of the table of services, responses, and the dispatcher that calls handlers."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from heptarm.errors import HeptarmError
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import put

_log = logging.getLogger("heptarm.ros")


@dataclass(frozen=True, slots=True)
class ServiceResponse:
    """Response of a service.

    Attributes:
        success: whether the request was carried out.
        message: what was done, or why not.
        fields: further fields of the response; nested messages are mappings.
    """

    success: bool
    message: str
    fields: Mapping[str, Any] = field(default_factory=dict)

    def fill(self, response: Any) -> Any:
        """Fill a ROS response.

        Returns:
            The response; None: not successful, and its type cannot say so (a standard type of ROS 1).
        """
        fields: dict[str, Any] = {"success": self.success, "message": self.message}
        if hasattr(response, "error"):  # of iiwa_stack: the text of an error, and nothing else
            fields = {"success": self.success, "error": "" if self.success else self.message}
        if not hasattr(response, "success"):
            if not self.success:
                return None
            fields = {}
        given = {name: value for name, value in fields.items() if hasattr(response, name)}
        put(response, {**given, **self.fields})
        return response


@dataclass(frozen=True, slots=True)
class Service:
    """A service of the nodes.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type"; its response has `success` and `message` or `error`, and fields of its own.
        handler: carries a request out; a returned text is a success with that message.
        at_once: never waits for another service.
    """

    name: str
    type: str
    handler: Callable[[NodeContext, Any], ServiceResponse | str]
    at_once: bool = False


class ServiceDispatcher:
    """Calls the handlers of services, one at a time unless a service is `at_once`.

    Args:
        context: of the node.
    """

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._lock = threading.Lock()

    def answer(self, service: Service, request: Any) -> ServiceResponse:
        """Carry a request out; errors become responses.

        Args:
            service: its row.
            request: with the fields of its type.
        """
        try:
            with contextlib.nullcontext() if service.at_once else self._lock:
                response = service.handler(self._context, request)
        except HeptarmError as error:
            return ServiceResponse(False, str(error))
        except Exception as error:  # it must not end the node, and with it the motion of the arm
            _log.exception("%s", service.name)
            return ServiceResponse(False, f"internal error of the node: {error!r}")
        return response if isinstance(response, ServiceResponse) else ServiceResponse(True, response)
