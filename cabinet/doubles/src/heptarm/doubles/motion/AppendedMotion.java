package heptarm.doubles.motion;

import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.RobotMotion;

import heptarm.doubles.plant.MotionListener;
import heptarm.doubles.seam.EndCause;

/** A motion appended to a running container; forwards its events to that container. */
public final class AppendedMotion implements MotionListener {
    final long id;
    final IMotion motion;
    private final MotionContainer container;

    AppendedMotion(MotionContainer container, long id, IMotion motion) {
        this.container = container;
        this.id = id;
        this.motion = motion;
    }

    @Override
    public void started() {
        container.appendedStarted(this);
    }

    @Override
    public void reached(int part) {
    }

    @Override
    public void fired(int part, boolean breaks, int index) {
        container.fired(part < 0 ? (RobotMotion<?>) motion : MotionTranslator.parts(motion).get(part), breaks, index);
    }

    @Override
    public void finished(int cause, String text) {
        container.finished(this, EndCause.of(cause), text);
    }
}
