package heptarm.samples;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.app.CabinetArm;
import heptarm.core.Arm;
import heptarm.core.Move;
import heptarm.core.Refusal;
import heptarm.core.Steering;
import heptarm.wire.JointImpedance;
import heptarm.wire.MotionFinished;
import heptarm.wire.PoseState;
import heptarm.wire.SafetyBits;

/** Stirs: a servo motion along a circle, soft joints, and how far the arm was off. Everything in SI. */
public class Stir extends RoboticsAPIApplication {
    private static final double RADIUS = 0.03;
    private static final double PERIOD = 2.0;
    private static final double[] STIFFNESS = {1500, 1500, 1500, 1500, 1000, 1000, 1000};
    private static final double[] DAMPING = {0.7, 0.7, 0.7, 0.7, 0.7, 0.7, 0.7};

    @Inject
    private LBR lbr;
    private Arm arm;

    @Override
    public void initialize() {
        arm = CabinetArm.of(lbr, getApplicationControl(), getLogger());
    }

    @Override
    public void run() throws Exception {
        arm.move(Move.ptp(0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0).speed(0.5));
        stir(new JointImpedance(STIFFNESS, DAMPING));
        getLogger().info("ready = " + ((arm.safety().bits & SafetyBits.READY_TO_MOVE) != 0));
    }

    private void stir(JointImpedance soft) throws Refusal, InterruptedException {
        PoseState start = arm.pose();
        double farthest = 0.0;
        Steering stream = arm.servo(0.5, 0.5, 0.5, soft);
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
