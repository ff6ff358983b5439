"""The public names of this package and where they live: the one list, read by type checkers and at run time."""

from .guard.fallback import (
    Missing as Missing,
)
from .guard.fallback import (
    Policy as Policy,
)
from .guard.joint_guard import (
    Limits as Limits,
)
from .guard.pose_guard import (
    PoseLimits as PoseLimits,
)
from .loop.client import (
    Client as Client,
)
from .loop.compiled import (
    CompiledLaw as CompiledLaw,
)
from .loop.compiled import (
    LawTrial as LawTrial,
)
from .loop.compiled import (
    include_dir as include_dir,
)
from .loop.law_interface import (
    LiveMemory as LiveMemory,
)
from .loop.law_interface import (
    Memory as Memory,
)
from .loop.parameters import (
    Param as Param,
)
from .loop.user_api import (
    Output as Output,
)
from .loop.user_api import (
    Params as Params,
)
from .loop.user_api import (
    State as State,
)
from .loop.user_api import (
    Stats as Stats,
)
from .protocol.messages import (
    CommandMode as CommandMode,
)
from .protocol.messages import (
    Quality as Quality,
)
from .protocol.messages import (
    RedundancyStrategy as RedundancyStrategy,
)
from .protocol.messages import (
    SessionState as SessionState,
)
