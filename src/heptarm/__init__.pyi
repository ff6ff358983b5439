"""The public names of this package and where they live: the one list, read by type checkers and at run time."""

from . import devices as devices
from . import shapes as shapes
from .arm.arm import (
    Arm as Arm,
)
from .arm.connect import (
    connect as connect,
)
from .arm.devices.camera import (
    CameraStream as CameraStream,
)
from .arm.fri.session import (
    Fri as Fri,
)
from .arm.link.state_stream import (
    States as States,
)
from .arm.link.target import (
    target_from_env as target_from_env,
)
from .arm.motion.chunks import (
    TakenChunk as TakenChunk,
)
from .arm.motion.following import (
    Detour as Detour,
)
from .arm.motion.following import (
    FollowedPath as FollowedPath,
)
from .arm.motion.handle import (
    MotionHandle as MotionHandle,
)
from .arm.motion.jog import (
    TwistServo as TwistServo,
)
from .arm.motion.jog import (
    VelocityServo as VelocityServo,
)
from .arm.motion.preview import (
    LimitApproach as LimitApproach,
)
from .arm.motion.preview import (
    ProgramPreview as ProgramPreview,
)
from .arm.motion.servo import (
    JointServo as JointServo,
)
from .arm.motion.servo import (
    PoseServo as PoseServo,
)
from .arm.motion.servo import (
    ServoStats as ServoStats,
)
from .arm.several import (
    Arms as Arms,
)
from .arm.several import (
    MotionOfArms as MotionOfArms,
)
from .arm.several import (
    StatesOfArms as StatesOfArms,
)
from .arm.several import (
    connect_all as connect_all,
)
from .arm.several import (
    start_together as start_together,
)
from .arm.several import (
    states_together as states_together,
)
from .arm.several import (
    stop_all as stop_all,
)
from .errors import (
    ArrivalError as ArrivalError,
)
from .errors import (
    CollisionDetected as CollisionDetected,
)
from .errors import (
    CollisionForeseen as CollisionForeseen,
)
from .errors import (
    CommandRejected as CommandRejected,
)
from .errors import (
    ConnectFailed as ConnectFailed,
)
from .errors import (
    ConnectionLost as ConnectionLost,
)
from .errors import (
    GraspFailed as GraspFailed,
)
from .errors import (
    HeptarmError as HeptarmError,
)
from .errors import (
    InsertionFailed as InsertionFailed,
)
from .errors import (
    LimitError as LimitError,
)
from .errors import (
    LocalProtocolError as LocalProtocolError,
)
from .errors import (
    MissingExtra as MissingExtra,
)
from .errors import (
    ModeConflict as ModeConflict,
)
from .errors import (
    MotionAborted as MotionAborted,
)
from .errors import (
    MotionError as MotionError,
)
from .errors import (
    NeedsOperator as NeedsOperator,
)
from .errors import (
    NoContact as NoContact,
)
from .errors import (
    NoPath as NoPath,
)
from .errors import (
    NotInControl as NotInControl,
)
from .errors import (
    NotReady as NotReady,
)
from .errors import (
    OutsideWorkspace as OutsideWorkspace,
)
from .errors import (
    ProtocolError as ProtocolError,
)
from .errors import (
    QualityLost as QualityLost,
)
from .errors import (
    RemoteProtocolError as RemoteProtocolError,
)
from .errors import (
    SafetyStop as SafetyStop,
)
from .errors import (
    ShapeError as ShapeError,
)
from .errors import (
    StaleState as StaleState,
)
from .errors import (
    Starved as Starved,
)
from .errors import (
    StreamError as StreamError,
)
from .errors import (
    Timeout as Timeout,
)
from .errors import (
    UnknownSetting as UnknownSetting,
)
from .errors import (
    Unreachable as Unreachable,
)
from .errors import (
    VersionMismatch as VersionMismatch,
)
from .export.files import (
    export_model as export_model,
)
from .fri.loop.compiled import (
    law as law,
)
from .fri.loop.compiled import (
    law_from as law_from,
)
from .fri.loop.parameters import (
    param as param,
)
from .record.demonstration import (
    Demonstration as Demonstration,
)
from .record.demonstration import (
    Demonstrations as Demonstrations,
)
from .record.demonstration import (
    load_episodes as load_episodes,
)
from .record.episodes import (
    Episode as Episode,
)
from .record.episodes import (
    EpisodeSet as EpisodeSet,
)
from .record.fri_client import (
    record_client as record_client,
)
from .record.hdf5 import (
    save_hdf5 as save_hdf5,
)
from .record.lerobot import (
    save_lerobot as save_lerobot,
)
from .record.pictures import (
    Pictures as Pictures,
)
from .record.recorder import (
    Recorder as Recorder,
)
from .record.recording import (
    Recording as Recording,
)
from .record.recording import (
    load as load,
)
from .sim.collision import (
    CollisionModel as CollisionModel,
)
from .skills.gripper import (
    Gripper as Gripper,
)
from .skills.gripper import (
    TwoSignalGripper as TwoSignalGripper,
)
from .skills.insertion import (
    Insertion as Insertion,
)
from .skills.replay import (
    Replay as Replay,
)
from .twin.comparison import (
    Deviation as Deviation,
)
from .twin.comparison import (
    RepeatedMotion as RepeatedMotion,
)
from .twin.comparison import (
    Twin as Twin,
)
from .twin.replay import (
    replay_in_sim as replay_in_sim,
)
from .values.camera import (
    Camera as Camera,
)
from .values.camera import (
    Picture as Picture,
)
from .values.clearance import (
    Clearance as Clearance,
)
from .values.clearance import (
    ForeseenCollision as ForeseenCollision,
)
from .values.clearance import (
    TouchOnPath as TouchOnPath,
)
from .values.condition.collision import (
    Collision as Collision,
)
from .values.condition.collision import (
    CollisionGuard as CollisionGuard,
)
from .values.condition.contact import (
    Contact as Contact,
)
from .values.condition.reaction import (
    Retreat as Retreat,
)
from .values.condition.trigger import (
    Trigger as Trigger,
)
from .values.motion.circle import (
    Circle as Circle,
)
from .values.motion.circle import (
    arc as arc,
)
from .values.motion.circle import (
    circ as circ,
)
from .values.motion.circle import (
    circle_through as circle_through,
)
from .values.motion.dynamics import (
    Dynamics as Dynamics,
)
from .values.motion.hand_guiding import (
    hand_guide as hand_guide,
)
from .values.motion.line import (
    lin as lin,
)
from .values.motion.line import (
    lin_rel as lin_rel,
)
from .values.motion.motion import (
    hold as hold,
)
from .values.motion.planned_path import (
    OnLine as OnLine,
)
from .values.motion.planned_path import (
    OnPlane as OnPlane,
)
from .values.motion.planned_path import (
    Path as Path,
)
from .values.motion.planned_path import (
    Region as Region,
)
from .values.motion.planned_path import (
    SearchStats as SearchStats,
)
from .values.motion.planned_path import (
    Upright as Upright,
)
from .values.motion.ptp import (
    ptp as ptp,
)
from .values.motion.ptp import (
    ptp_home as ptp_home,
)
from .values.motion.ptp import (
    ptp_transport as ptp_transport,
)
from .values.motion.search import (
    Spiral as Spiral,
)
from .values.motion.search import (
    spiral as spiral,
)
from .values.motion.spline import (
    ellipse as ellipse,
)
from .values.motion.spline import (
    spl as spl,
)
from .values.motion.spline import (
    spline as spline,
)
from .values.motion.spline import (
    spline_joints as spline_joints,
)
from .values.motion.trajectory import (
    Trajectory as Trajectory,
)
from .values.pose import (
    PartialPose as PartialPose,
)
from .values.pose import (
    Pose as Pose,
)
from .values.pose import (
    Redundancy as Redundancy,
)
from .values.pose import (
    deg as deg,
)
from .values.result import (
    Cause as Cause,
)
from .values.result import (
    MotionEvent as MotionEvent,
)
from .values.result import (
    Recovery as Recovery,
)
from .values.result import (
    Result as Result,
)
from .values.state import (
    State as State,
)
from .values.tool import (
    Tool as Tool,
)
from .values.tool import (
    Workpiece as Workpiece,
)
from .values.workspace import (
    Workspace as Workspace,
)
from .viewers.live import (
    LiveView as LiveView,
)
from .viewers.live import (
    live as live,
)

__version__: str
