package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.plant.PlantClock;
import heptarm.doubles.plant.SharedState;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Seam;

/**
 * Waits for each tick, so that ticks are computed ahead, and looks whether any state can be read before it is due.
 *
 * <p>A busy machine may leave no time to compute ahead, so it goes on until one tick was, for a minute at most.
 */
public class Foreseeing extends RoboticsAPIApplication {
    private static final int TICKS = 1500;
    private static final int MOST = 60000;

    @Inject
    private LBR lbr;
    private volatile boolean awaits = true;
    private volatile int ahead;
    private volatile int wokenEarly;

    @Override
    public void run() {
        SharedState states = Station.current().sharedState;
        lbr.moveAsync(ptp(1.0, 0, 0, 0, 0, 0, 0).setJointVelocityRel(0.01));
        Thread waiting = new Thread(() -> await(states));
        waiting.start();
        int early = 0;
        while (awaits) {
            long newest = states.newest();
            early += System.nanoTime() < states.wallTime(newest) ? 1 : 0;
            if (states.computed() > newest && System.nanoTime() < states.wallTime(newest + 1)) {
                ahead++;
            }
        }
        try (PrintWriter out = new PrintWriter((String) getApplicationData().getProcessData("sample.file").getValue(), "UTF-8")) {
            out.println(ahead);
            out.println(early);
            out.println(wokenEarly);
        } catch (Exception e) {
            throw new IllegalStateException(e);
        }
    }

    private void await(SharedState states) {
        PlantClock clock = new PlantClock();
        try {
            long next = clock.nanos();
            for (int i = 0; i < TICKS || ahead == 0 && i < MOST; i++) {
                long now = clock.sleepUntil(next);
                wokenEarly += System.nanoTime() < states.wallTime(now / Seam.TICK_NS) ? 1 : 0;
                next = now + Seam.TICK_NS;
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        } finally {
            awaits = false;
        }
    }
}
