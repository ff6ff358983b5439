package heptarm.doubles2;

import com.kuka.fri.api.commanding.IFriCommanding;
import com.kuka.fri.api.monitoring.IFriMonitoring;
import com.kuka.med.cyclicbraketest.EBraketestMonitorState;
import com.kuka.med.cyclicbraketest.IBraketestMonitor;

/** The options of this cabinet: FRI Med 3.0 and the cyclic brake test. */
public final class Capabilities {
    private Capabilities() {
    }

    public static <T> T of(Class<T> type) {
        if (type == IFriMonitoring.class || type == IFriCommanding.class) {
            return type.cast(new FriMed());
        }
        if (type == IBraketestMonitor.class) {
            return type.cast((IBraketestMonitor) () -> EBraketestMonitorState.PENDING);
        }
        throw new IllegalStateException("this cabinet has no capability " + type.getName());
    }
}
