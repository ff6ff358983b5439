"""What is used in a `with` block: at its end it tells what ended it earlier."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from types import TracebackType

from heptarm.errors import HeptarmError

_log = logging.getLogger("heptarm.arm")


class Block(ABC):
    """Something that lasts for a `with` block.

    Attributes:
        what: its name in the log.
    """

    what: str

    @abstractmethod
    def close(self) -> None:
        """End it; raises what ended it early. Closing twice is legal."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End it; raises what ended it early, unless another error is on its way."""
        try:
            self.close()
        except HeptarmError as trouble:
            if error is None:
                raise
            _log.warning("closing the %s: %s", self.what, trouble)
