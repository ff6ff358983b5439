package heptarm.doubles.runtime;

import com.kuka.roboticsAPI.annotations.AutomaticResumeManager;
import com.kuka.roboticsAPI.annotations.ResumeAfterPauseEvent;

import heptarm.doubles.seam.SafetyFlags;

/** Resumes a paused application after a stop if its annotation requests that; never after the operator's pause. */
public final class AutomaticResume {
    public final AutomaticResumeManager manager = new AutomaticResumeManager();
    private final Station station;
    private boolean stopped;

    AutomaticResume(Station station) {
        this.station = station;
    }

    /** The safety flags have changed; called on the dispatch thread. */
    void changed(long flags) {
        boolean paused = (flags & SafetyFlags.PAUSED) != 0;
        boolean ready = (flags & SafetyFlags.READY) != 0;
        if (paused && ready && stopped) {
            resumeAfterDelay();
        }
        stopped = paused && !ready;
    }

    private void resumeAfterDelay() {
        Class<?> application = station.tasks.application();
        ResumeAfterPauseEvent requested = application == null ? null : application.getAnnotation(ResumeAfterPauseEvent.class);
        if (requested == null || !manager.mayResume(application)) {
            return;
        }
        Thread waiting = new Thread(() -> {
            try {
                station.sleep(requested.delay() * 1000000L);
                station.plant.resume(); // has no effect if another stop was requested meanwhile
            } catch (InterruptedException e) {
                Thread.currentThread().interrupt();
            }
        }, "automatic-resume");
        waiting.setDaemon(true);
        waiting.start();
    }
}
