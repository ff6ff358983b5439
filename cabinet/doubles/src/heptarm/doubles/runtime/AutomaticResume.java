package heptarm.doubles;

import com.kuka.roboticsAPI.annotations.AutomaticResumeManager;
import com.kuka.roboticsAPI.annotations.ResumeAfterPauseEvent;

/** Lets the application go on after a stop, if it has asked for that; not after the operator's pause. */
public final class Resuming {
    public final AutomaticResumeManager manager = new AutomaticResumeManager();
    private final Station station;
    private boolean stopped;

    Resuming(Station station) {
        this.station = station;
    }

    /** The flags have changed; called on the dispatch thread. */
    void changed(long flags) {
        boolean paused = (flags & Ring.PAUSED) != 0;
        boolean ready = (flags & Ring.READY) != 0;
        if (paused && ready && stopped) {
            goOn();
        }
        stopped = paused && !ready;
    }

    private void goOn() {
        Class<?> application = station.tasks.application();
        ResumeAfterPauseEvent wish = application == null ? null : application.getAnnotation(ResumeAfterPauseEvent.class);
        if (wish == null || !manager.mayResume(application)) {
            return;
        }
        Thread waiting = new Thread(() -> {
            try {
                station.sleep(wish.delay() * 1000000L);
                station.plant.resume(); // a stop demanded meanwhile keeps it from going on
            } catch (InterruptedException e) {
                Thread.currentThread().interrupt();
            }
        }, "resuming");
        waiting.setDaemon(true);
        waiting.start();
    }
}
