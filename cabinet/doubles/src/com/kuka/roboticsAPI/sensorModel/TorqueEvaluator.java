package com.kuka.roboticsAPI.sensorModel;

import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.plant.PeriodicSampler;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.StateWords;

/** Finds the largest torque of each joint between two times, sampled every simulated millisecond. */
public class TorqueEvaluator {
    private static final long PERIOD_NS = 1000000L;

    private final Station station = Station.current();
    private final double[] most;
    private boolean measured = true;
    private PeriodicSampler sampling;

    public TorqueEvaluator(LBR robot) {
        most = new double[robot.getJointCount()];
    }

    /** True: measured torques; false: commanded torques. */
    public void setTorqueMeasured(boolean value) {
        measured = value;
    }

    public synchronized void startEvaluation() {
        if (sampling != null) {
            throw new IllegalStateException("an evaluation is already running");
        }
        java.util.Arrays.fill(most, 0.0);
        int word = measured ? StateWords.TAU : StateWords.TAU_CMD;
        double[] torques = new double[most.length];
        sampling = new PeriodicSampler(PERIOD_NS, nanos -> {
            station.sharedState.read(word, torques);
            for (int i = 0; i < most.length; i++) {
                most[i] = Math.max(most[i], Math.abs(torques[i]));
            }
        });
        sampling.start();
    }

    public synchronized TorqueStatistic stopEvaluation() {
        if (sampling == null) {
            throw new IllegalStateException("no evaluation is running");
        }
        sampling.stop();
        sampling = null;
        return new TorqueStatistic(most);
    }
}
