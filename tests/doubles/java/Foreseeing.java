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

/** Waits for each tick, so that ticks are computed ahead, and looks whether any state can be read before it is due. */
public class Foreseeing extends RoboticsAPIApplication {
    private static final int TICKS = 1500;

    @Inject
    private LBR lbr;
    private volatile boolean awaits = true;
    private volatile int wokenEarly;

    @Override
    public void run() {
        SharedState states = Station.current().sharedState;
        lbr.moveAsync(ptp(1.0, 0, 0, 0, 0, 0, 0).setJointVelocityRel(0.1));
        Thread waiting = new Thread(() -> await(states));
        waiting.start();
        int ahead = 0;
        int early = 0;
        while (awaits) {
            long newest = states.newest();
            early += System.nanoTime() < states.wallTime(newest) ? 1 : 0;
            ahead += states.computed() > newest && System.nanoTime() < states.wallTime(newest + 1) ? 1 : 0;
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
            for (int i = 0; i < TICKS; i++) {
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
