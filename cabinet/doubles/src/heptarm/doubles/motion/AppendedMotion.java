package heptarm.doubles;

import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

/** A motion that was put behind a container's own; what becomes of it is told to the container. */
public final class Appended implements MotionListener {
    final long id;
    final IMotion motion;
    private final Container container;

    Appended(Container container, long id, IMotion motion) {
        this.container = container;
        this.id = id;
        this.motion = motion;
    }

    @Override
    public void started() {
        container.begins(this);
    }

    @Override
    public void reached(int part) {
    }

    @Override
    public void fired(int part, boolean breaks, int index) {
        container.fired(part < 0 ? (RobotMotion<?>) motion : Orders.parts(motion).get(part), breaks, index);
    }

    @Override
    public void finished(String cause, String text) {
        container.finished(this, cause, text);
    }
}
