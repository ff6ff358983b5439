package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.IExecutionListener;
import com.kuka.roboticsAPI.controllerModel.IExecutionService;

import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.StateWords;

/** Pauses, resumes and cancels the execution of the cabinet. */
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

    /** Whether execution is paused and the arm is at rest. */
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

    /** Resumes execution unless a stop is requested; without motion: drops the interrupted motions first. */
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

    /** Blocks motions until {@link #unblockExecutionForBrakeTest}. */
    public void blockExecutionForBrakeTest() {
        startPause();
    }

    public void unblockExecutionForBrakeTest() {
        station.plant.resume();
    }

    /** Its former name. */
    public int getActiveContainerCount() {
        return getActiveMotionContainerCount();
    }

    public int getActiveMotionContainerCount() {
        return station.robot.activeContainers();
    }
}
