package heptarm.doubles;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import com.kuka.roboticsAPI.controllerModel.IControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.IExecutionListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.deviceModel.OperationMode;

/** Tells listeners of changes of the safety state, of readiness and of pauses, on the dispatch thread. */
public final class SafetyNews {
    private static final long SAFETY = Ring.EMERGENCY_STOP | Ring.EXTERNAL_STOP | Ring.SAFEGUARD_OPEN | Ring.PROTECTIVE_STOP
            | Ring.DRIVE_ERROR | Ring.ENABLED | Ring.HAND_GUIDING;

    public final List<IControllerStateListener> states = new CopyOnWriteArrayList<>();
    public final List<IExecutionListener> executions = new CopyOnWriteArrayList<>();
    private final Station station;
    private long flags = Ring.READY;
    private long mode = OperationMode.AUT.ordinal();

    SafetyNews(Station station) {
        this.station = station;
    }

    /** Something has changed; called by the plant's thread, must not block. */
    void changed(long newFlags, long newMode) {
        station.dispatch.execute(() -> tell(newFlags, newMode));
    }

    private void tell(long newFlags, long newMode) {
        long changed = flags ^ newFlags;
        boolean modeChanged = mode != newMode;
        flags = newFlags;
        mode = newMode;
        station.resuming.changed(newFlags);
        SunriseSafetyState state = new SunriseSafetyState(newFlags, OperationMode.values()[(int) newMode]);
        boolean ready = (newFlags & Ring.READY) != 0 && (newFlags & Ring.PAUSED) == 0;
        for (IControllerStateListener one : states) {
            if (!(one instanceof ISunriseControllerStateListener)) {
                continue;
            }
            ISunriseControllerStateListener listener = (ISunriseControllerStateListener) one;
            if ((changed & SAFETY) != 0 || modeChanged) {
                careful(() -> listener.onSafetyStateChanged(station.robot, state));
            }
            if ((changed & (Ring.READY | Ring.PAUSED)) != 0) {
                careful(() -> listener.onIsReadyToMoveChanged(station.robot, ready));
            }
        }
        if ((changed & Ring.PAUSED) == 0) {
            return;
        }
        for (IExecutionListener one : executions) {
            if ((newFlags & Ring.PAUSED) != 0) {
                careful(() -> one.onExecutionPaused(station.controller));
            } else {
                careful(() -> one.onExecutionResumed(station.controller, ResumeMode.OnPath));
            }
        }
    }

    /** An exception of the application's listener must not keep others from being told. */
    private static void careful(Runnable news) {
        try {
            news.run();
        } catch (RuntimeException e) {
            Desk.current().logger.error("a listener ended with an error", e);
        }
    }
}
