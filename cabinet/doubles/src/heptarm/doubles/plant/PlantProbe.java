package heptarm.doubles.plant;

import java.util.ArrayList;
import java.util.List;

import heptarm.core.robot.SimulatorProbe;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.BodyShape;
import heptarm.doubles.seam.CarriedBodies;
import heptarm.doubles.seam.CarriedBody;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.ShapeKind;
import heptarm.doubles.seam.StateWords;
import heptarm.wire.Pose;
import heptarm.wire.SafetyBits;
import heptarm.wire.ToolInfo;

/** Provides commanded torques, progress, brake state, fast stops and shapes on the flange of the simulated robot, which a real cabinet does not offer. */
public final class PlantProbe implements SimulatorProbe {
    private final SharedState state = Station.current().sharedState;

    @Override
    public void readTorques(double[] commanded) {
        state.read(StateWords.TAU_CMD, commanded);
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        progressAndRemaining[0] = state.number(StateWords.PROGRESS);
        progressAndRemaining[1] = state.number(StateWords.REMAINING);
    }

    @Override
    public int safetyBits() {
        return state.flag(SafetyFlags.BRAKES_OPEN) ? SafetyBits.BRAKES_OPEN : 0;
    }

    @Override
    public void stopFast() {
        Station.current().plant.stopFast();
    }

    @Override
    public void mount(ToolInfo tool, ToolInfo workpiece, Pose holding) {
        List<CarriedBody> bodies = new ArrayList<>();
        if (tool != null && tool.shapes.length > 0) {
            bodies.add(body(tool, true, new double[] {0, 0, 0, 0, 0, 0, 1}));
        }
        if (workpiece != null && workpiece.shapes.length > 0) {
            bodies.add(body(workpiece, false, numbers(holding)));
        }
        CarriedBodies carried = new CarriedBodies();
        carried.bodies = bodies.toArray(new CarriedBody[0]);
        Station.current().plant.setCarriedBodies(carried);
        Station.current().settle();
    }

    private static CarriedBody body(ToolInfo info, boolean isTool, double[] pose) {
        CarriedBody body = new CarriedBody();
        body.name = info.name;
        body.isTool = isTool;
        body.pose = pose;
        body.shapes = new BodyShape[info.shapes.length];
        for (int i = 0; i < info.shapes.length; i++) {
            BodyShape shape = body.shapes[i] = new BodyShape();
            shape.kind = ShapeKind.valueOf(info.shapes[i].kind.name());
            shape.size = info.shapes[i].size;
            shape.pose = numbers(info.shapes[i].pose);
        }
        return body;
    }

    private static double[] numbers(Pose pose) {
        return new double[] {pose.xyz[0], pose.xyz[1], pose.xyz[2], pose.quat[0], pose.quat[1], pose.quat[2], pose.quat[3]};
    }
}
