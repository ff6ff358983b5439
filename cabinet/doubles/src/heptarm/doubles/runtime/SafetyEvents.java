package heptarm.doubles.runtime;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import com.kuka.roboticsAPI.controllerModel.IControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.IExecutionListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.deviceModel.OperationMode;

import heptarm.doubles.seam.SafetyFlags;

/** Dispatches changes of the safety state, of readiness and of pauses to listeners, on the dispatch thread. */
public final class SafetyEvents {
    private static final long SAFETY = SafetyFlags.EMERGENCY_STOP | SafetyFlags.EXTERNAL_STOP | SafetyFlags.SAFEGUARD_OPEN | SafetyFlags.PROTECTIVE_STOP
            | SafetyFlags.DRIVE_ERROR | SafetyFlags.ENABLED | SafetyFlags.HAND_GUIDING;

    public final List<IControllerStateListener> states = new CopyOnWriteArrayList<>();
    public final List<IExecutionListener> executions = new CopyOnWriteArrayList<>();
    private final Station station;
    private long flags = SafetyFlags.READY;
    private long mode = heptarm.doubles.seam.OperationMode.AUT.value();

    SafetyEvents(Station station) {
        this.station = station;
    }

    /** The operation mode of the plant in Sunrise's terms. */
    public static OperationMode operationMode(long mode) {
        return OperationMode.valueOf(heptarm.doubles.seam.OperationMode.of(mode).name());
    }

    /** Flags or operation mode have changed in a tick; called on the realtime thread of the plant, must not block. */
    void changed(long tick, long newFlags, long newMode) {
        station.dispatch.execute(() -> {
            try {
                station.timers.awaitDue(tick); // a listener that reads the state sees the change in it
            } catch (InterruptedException e) {
                Thread.currentThread().interrupt(); // the station ends; listeners still receive a stop
            }
            dispatch(newFlags, newMode);
        });
    }

    private void dispatch(long newFlags, long newMode) {
        long changed = flags ^ newFlags;
        boolean modeChanged = mode != newMode;
        flags = newFlags;
        mode = newMode;
        station.automaticResume.changed(newFlags);
        SunriseSafetyState state = new SunriseSafetyState(newFlags, operationMode(newMode));
        boolean ready = (newFlags & SafetyFlags.READY) != 0 && (newFlags & SafetyFlags.PAUSED) == 0;
        for (IControllerStateListener one : states) {
            if (!(one instanceof ISunriseControllerStateListener)) {
                continue;
            }
            ISunriseControllerStateListener listener = (ISunriseControllerStateListener) one;
            if ((changed & SAFETY) != 0 || modeChanged) {
                callGuarded(() -> listener.onSafetyStateChanged(station.robot, state));
            }
            if ((changed & (SafetyFlags.READY | SafetyFlags.PAUSED)) != 0) {
                callGuarded(() -> listener.onIsReadyToMoveChanged(station.robot, ready));
            }
        }
        if ((changed & SafetyFlags.PAUSED) == 0) {
            return;
        }
        for (IExecutionListener one : executions) {
            if ((newFlags & SafetyFlags.PAUSED) != 0) {
                callGuarded(() -> one.onExecutionPaused(station.controller));
            } else {
                callGuarded(() -> one.onExecutionResumed(station.controller, ResumeMode.OnPath));
            }
        }
    }

    /** An exception in one listener of the application must not keep the others from being called. */
    private static void callGuarded(Runnable event) {
        try {
            event.run();
        } catch (RuntimeException e) {
            ApplicationServices.current().logger.error("a listener ended with an error", e);
        }
    }
}
