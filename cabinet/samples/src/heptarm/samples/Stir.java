package heptarm.samples;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.app.CabinetArm;
import heptarm.core.CommandRejected;
import heptarm.core.api.Arm;
import heptarm.core.api.Impedance;
import heptarm.core.api.Move;
import heptarm.core.api.ServoHandle;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.FrameInfo;
import heptarm.wire.JointImpedance;
import heptarm.wire.MotionFinished;
import heptarm.wire.PoseState;
import heptarm.wire.SafetyBits;
import heptarm.wire.Shape;
import heptarm.wire.ToolInfo;

/** Stirs with a spoon: a servo motion along a circle, compliant joints, then straight lines with Cartesian compliance. Everything in SI. */
public class Stir extends RoboticsAPIApplication {
    private static final double RADIUS = 0.03;
    private static final double PERIOD = 2.0;
    private static final double[] STIFFNESS = {1500, 1500, 1500, 1500, 1000, 1000, 1000};
    private static final double[] DAMPING = {0.7, 0.7, 0.7, 0.7, 0.7, 0.7, 0.7};

    private static final ToolInfo SPOON = new ToolInfo("spoon", 0.2, new double[] {0, 0, 0.08}, new double[6],
            new FrameInfo[] {new FrameInfo("bowl", Move.pose(0, 0, 0.15))}, new Shape[0]);

    @Inject
    private LBR lbr;
    private Arm arm;

    @Override
    public void initialize() {
        arm = CabinetArm.of(lbr, this);
    }

    @Override
    public void run() throws Exception {
        arm.move(Move.ptp(0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0).speed(0.5));
        arm.define(SPOON);
        arm.attach(SPOON.name);
        arm.write("MediaFlange.LEDGreen", 1);
        getLogger().info("tool = " + arm.attached()[0] + ", moving its " + arm.attached()[2]);
        stir(new JointImpedance(STIFFNESS, DAMPING));
        scrape();
        arm.write("MediaFlange.LEDGreen", 0);
        arm.detach();
        getLogger().info("ready = " + ((arm.safety().bits & SafetyBits.READY_TO_MOVE) != 0));
    }

    private void stir(JointImpedance compliant) throws CommandRejected, InterruptedException {
        PoseState start = arm.pose();
        double farthest = 0.0;
        ServoHandle stream = arm.servo(0.5, 0.5, 0.5, compliant);
        long began = System.nanoTime();
        for (double t = 0.0; t < 2 * PERIOD && !stream.isFinished(); t = (System.nanoTime() - began) * 1e-9) {
            double angle = 2 * Math.PI * t / PERIOD;
            double[] target = start.xyz.clone();
            target[0] += RADIUS * (Math.cos(angle) - 1.0);
            target[1] += RADIUS * Math.sin(angle);
            stream.follow(target, start.quat);
            Thread.sleep(10);
            farthest = Math.max(farthest, Math.abs(arm.pose().xyz[1] - start.xyz[1]));
        }
        MotionFinished end = stream.close();
        getLogger().info("stirred = " + end.cause + ", " + Math.round(1000 * farthest) + " mm to the side");
    }

    /** Along the edge of the bowl and back: straight lines, compliant downwards, with decreasing stiffness. */
    private void scrape() throws CommandRejected, InterruptedException {
        PoseState start = arm.pose();
        Impedance compliant = Impedance.cartesian(2000, 2000, 800, 200, 200, 200).damping(0.8).along("base");
        double[] corner = start.xyz.clone();
        corner[1] += RADIUS;
        double nan = Double.NaN;
        ServoHandle line = arm.servoLin(new CartesianDynamics(0.1, 0.5, nan, 0.5, 2.0, nan), 0.5, compliant.mode());
        for (int i = 0; i < 150 && !line.isFinished(); i++) {
            line.follow(i < 75 ? corner : start.xyz, start.quat);
            if (i == 75) {
                line.changeMode(Impedance.cartesian(2000, 2000, 400, 200, 200, 200).damping(0.8).along("base").mode());
            }
            Thread.sleep(10);
        }
        MotionFinished end = line.close();
        getLogger().info("scraped = " + end.cause + ", lamp " + arm.read("MediaFlange.LEDGreen"));
    }

    @Override
    public void dispose() {
        try {
            if (arm != null) {
                arm.close();
            }
        } finally {
            super.dispose();
        }
    }
}
