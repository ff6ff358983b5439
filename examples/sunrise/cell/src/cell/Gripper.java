package cell;

import com.kuka.common.ThreadUtil;
import com.kuka.generated.ioAccess.CellIOGroup;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;

/** The gripper: a tool that closes by an output and holds a part. */
public class Gripper extends Tool {
    private static final long CLOSING_MS = 150;

    private Workpiece held;

    public Gripper(String name) {
        super(name);
    }

    /** Closes about a part; from now on its load counts. */
    public void grip(CellIOGroup io, Workpiece part) {
        io.setGrip(true);
        ThreadUtil.milliSleep(CLOSING_MS);
        part.attachTo(getDefaultMotionFrame());
        held = part;
    }

    /** Opens, and leaves the part where it is. */
    public void release(CellIOGroup io) {
        io.setGrip(false);
        ThreadUtil.milliSleep(CLOSING_MS);
        if (held != null) {
            held.detach();
            held = null;
        }
    }
}
