package com.kuka.roboticsAPI.controllerModel.sunrise;

import com.kuka.roboticsAPI.controllerModel.IExecutionService;

import heptarm.doubles.Ring;
import heptarm.doubles.Station;

/** Pausing, resuming and cancelling what the cabinet executes. */
public final class SunriseExecutionService implements IExecutionService {
    private final Station station;

    public SunriseExecutionService(Station station) {
        this.station = station;
    }

    private long flags() {
        return station.ring.integer(Ring.FLAGS);
    }

    public boolean isPaused() {
        return (flags() & Ring.PAUSED) != 0;
    }

    public void startPause() {
        station.plant.pause();
    }

    public void resumeExecution(ResumeMode mode) {
        station.plant.resume();
    }

    @Override
    public void cancelAll() {
        station.plant.cancelAll();
    }

    public int getActiveMotionContainerCount() {
        return station.robot.activeContainers();
    }
}
