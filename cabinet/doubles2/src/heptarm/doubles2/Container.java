package heptarm.doubles2;

import java.util.Collections;
import java.util.Map;
import java.util.WeakHashMap;

import com.kuka.motion.IMotionContainer;
import com.kuka.motion.IMotionContainerListener;
import com.kuka.motion.MotionContainerState;

/** A motion container; one for each of those behind. A listener that comes late misses what was before, as on a cabinet. */
public final class Container implements IMotionContainer {
    private static final Map<heptarm.sunrise1.roboticsAPI.motionModel.IMotionContainer, Container> ALL =
            Collections.synchronizedMap(new WeakHashMap<>());
    private static final long POLL_MS = 2;

    private final heptarm.sunrise1.roboticsAPI.motionModel.IMotionContainer behind;

    private Container(heptarm.sunrise1.roboticsAPI.motionModel.IMotionContainer behind) {
        this.behind = behind;
    }

    public static Container of(heptarm.sunrise1.roboticsAPI.motionModel.IMotionContainer behind) {
        return ALL.computeIfAbsent(behind, Container::new);
    }

    @Override
    public void cancel() {
        behind.cancel();
    }

    @Override
    public boolean isFinished() {
        return behind.isFinished();
    }

    @Override
    public String getErrorMessage() {
        return behind.getErrorMessage();
    }

    @Override
    public MotionContainerState getState() {
        if (!behind.isFinished()) {
            return MotionContainerState.RUNNING;
        }
        return behind.hasError() ? MotionContainerState.ERROR : MotionContainerState.ENDED;
    }

    @Override
    public void addContainerListener(IMotionContainerListener listener) {
        Thread watcher = new Thread(() -> watch(listener), "sunrise2-container");
        watcher.setDaemon(true);
        watcher.start();
    }

    private void watch(IMotionContainerListener listener) {
        try {
            while (!getState().isFinal()) {
                Thread.sleep(POLL_MS);
            }
            listener.onContainerStateChanged(this, getState());
            listener.containerFinished(this);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
