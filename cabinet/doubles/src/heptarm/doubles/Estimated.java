package heptarm.doubles;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/** A condition on the estimated external force or torque at a frame. The simulation's estimate is exact: tolerances never count. */
public abstract class Estimated extends Criterion {
    private final AbstractFrame measured;
    private final AbstractFrame orientation;

    protected Estimated(AbstractFrame measured, AbstractFrame orientation) {
        this.measured = measured;
        this.orientation = orientation;
    }

    /** Where it is measured; null: at the flange. */
    final AbstractFrame measured() {
        return measured;
    }

    /** Whose axes count; null: those of the measuring frame. */
    final AbstractFrame orientation() {
        return orientation == null ? measured : orientation;
    }
}
