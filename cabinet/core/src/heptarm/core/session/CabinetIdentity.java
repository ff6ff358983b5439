package heptarm.core.session;

import heptarm.core.robot.Robot;
import heptarm.core.tools.ToolTable;
import heptarm.wire.Groups;
import heptarm.wire.Protocol;
import heptarm.wire.Welcome;

/** How this cabinet introduces itself. */
final class CabinetIdentity {
    private static final int ALL_GROUPS = Groups.JOINTS | Groups.TORQUES | Groups.POSE | Groups.WRENCH | Groups.MOTION
            | Groups.SAFETY | Groups.IO | Groups.MODE;

    private final ServerSettings settings;
    private final Robot robot;
    private final ToolTable tools;
    private final ControlAuthority authority;

    CabinetIdentity(ServerSettings settings, Robot robot, ToolTable tools, ControlAuthority authority) {
        this.settings = settings;
        this.robot = robot;
        this.tools = tools;
        this.authority = authority;
    }

    /** The Welcome, without a proof of the key. */
    Welcome welcome(int session) {
        return new Welcome(Protocol.MAJOR, Protocol.MINOR, session, ServerSettings.VERSION, robot.cabinet, robot.isVirtual, robot.info,
                robot.capabilities, tools.known(), robot.tools.frames(), robot.signals.signals(), ALL_GROUPS, settings.maxRate,
                settings.heartbeat, authority.name(), new byte[0]);
    }
}
