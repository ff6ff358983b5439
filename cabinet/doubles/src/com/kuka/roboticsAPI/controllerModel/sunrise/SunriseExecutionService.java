package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.IExecutionListener;
import com.kuka.roboticsAPI.controllerModel.IExecutionService;

import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.StateWords;

/** Pausing, resuming and cancelling what the cabinet executes. */
public final class SunriseExecutionService implements IExecutionService {
    private static final double AT_REST = 0.001;

    private final Station station;

    public SunriseExecutionService(Station station) {
        this.station = station;
    }

    private long flags() {
        return station.sharedState.integer(StateWords.FLAGS);
    }

    public boolean isPaused() {
        return (flags() & SafetyFlags.PAUSED) != 0;
    }

    /** Whether execution is paused and the arm rests. */
    public boolean isPausedAndStopped() {
        double[] speed = new double[7];
        station.sharedState.read(StateWords.DQ, speed);
        for (double one : speed) {
            if (Math.abs(one) > AT_REST) {
                return false;
            }
        }
        return isPaused();
    }

    public void addExecutionListener(IExecutionListener listener) {
        station.safetyEvents.executions.add(listener);
    }

    public void removeExecutionListener(IExecutionListener listener) {
        station.safetyEvents.executions.remove(listener);
    }

    public void clearExecutionContainerQueues() {
        station.plant.cancelAll();
    }

    public void startPause() {
        station.plant.pause();
    }

    /** Lets execution go on unless a stop is demanded; without motion: what was under way is dropped before. */
    public void resumeExecution(ResumeMode mode) {
        if (mode == ResumeMode.NoMotion) {
            station.plant.cancelAll();
        }
        station.plant.resume();
    }

    @Override
    public void cancelAll() {
        station.plant.cancelAll();
    }

    /** Keeps motions from running until {@link #unblockExecutionForBrakeTest}. */
    public void blockExecutionForBrakeTest() {
        startPause();
    }

    public void unblockExecutionForBrakeTest() {
        station.plant.resume();
    }

    /** Its older name. */
    public int getActiveContainerCount() {
        return getActiveMotionContainerCount();
    }

    public int getActiveMotionContainerCount() {
        return station.robot.activeContainers();
    }
}
