package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.motion.AbstractCondition;
import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.PathReached;
import heptarm.doubles.seam.PathReference;

/** A point on the path is reached: a distance [mm] from its start or, negative, before its destination; and a delay [ms]. */
public class MotionPathCondition extends AbstractCondition {
    private final ReferenceType reference;
    private final double distance;
    private final long delay;

    public MotionPathCondition(ReferenceType reference, double distance, long delay) {
        if (!(reference == ReferenceType.START ? distance >= 0.0 : distance <= 0.0)) {
            throw new IllegalArgumentException("the point must be on the path, got " + distance + " mm from " + reference);
        }
        this.reference = reference;
        this.distance = distance;
        this.delay = delay;
    }

    @Override
    protected Condition forPlant(LBR robot) {
        PathReached reached = new PathReached();
        reached.reference = reference == ReferenceType.START ? PathReference.START : PathReference.END;
        reached.distance = distance * 1e-3;
        reached.delay = delay * 1e-3;
        return reached;
    }
}
