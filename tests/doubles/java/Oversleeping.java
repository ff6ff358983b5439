package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.plant.PlantClock;

/** Looks at a moving arm every 10 ms and sometimes wakes 0.3 s late; what it sees belongs to the time stamp beside it. */
public class Oversleeping extends RoboticsAPIApplication {
    private static final long STEP = 10000000L;

    @Inject
    private LBR lbr;

    @Override
    public void run() {
        try {
            double fastest = watch();
            PrintWriter out = new PrintWriter((String) getApplicationData().getProcessData("sample.file").getValue(), "UTF-8");
            out.println(fastest);
            double[] moved = hold();
            out.println(moved[0]);
            out.println(moved[1]);
            out.close();
        } catch (Exception e) {
            throw new IllegalStateException(e);
        }
    }

    /** How far A1 seems to turn in 0.4 s while the instant is held, and when it is released [rad]. */
    private double[] hold() throws InterruptedException {
        PlantClock clock = new PlantClock();
        clock.hold(clock.sleepUntil(clock.nanos()));
        long stamp = clock.stamp();
        double before = lbr.getCommandedJointPosition().get(0);
        Thread.sleep(400);
        if (clock.stamp() != stamp) {
            throw new IllegalStateException("the instant has moved");
        }
        double held = lbr.getCommandedJointPosition().get(0) - before;
        clock.release();
        return new double[] {held, lbr.getCommandedJointPosition().get(0) - before};
    }

    /** The fastest that A1 seems to turn [rad/s], in transit at 0.1 of its maximum. */
    private double watch() throws InterruptedException {
        PlantClock clock = new PlantClock();
        lbr.moveAsync(ptp(1.0, 0, 0, 0, 0, 0, 0).setJointVelocityRel(0.1));
        double fastest = 0.0;
        double last = lbr.getCommandedJointPosition().get(0);
        long before = clock.sleepUntil(clock.nanos());
        for (int look = 1; look <= 150; look++) {
            long now = clock.sleepUntil(before + STEP);
            if (now < before + STEP) {
                throw new IllegalStateException("woken before the tick was published");
            }
            double place = lbr.getCommandedJointPosition().get(0);
            fastest = Math.max(fastest, Math.abs(place - last) / ((now - before) * 1e-9));
            last = place;
            before = now;
            if (look % 50 == 0) {
                Thread.sleep(300);
            }
        }
        return fastest;
    }
}
