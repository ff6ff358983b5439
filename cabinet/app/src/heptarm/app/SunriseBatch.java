package heptarm.app;

import com.kuka.roboticsAPI.motionModel.IMotion;

import heptarm.core.robot.MotionJob;

/** A batch of Sunrise as a job of the core: one container, whose motions are reported one by one. */
final class SunriseBatch extends SunriseJob {
    private final IMotion[] motions;
    private final Parts parts;

    SunriseBatch(IMotion[] motions, MotionJob.Listener[] listeners) {
        this(motions, new Parts(listeners));
    }

    private SunriseBatch(IMotion[] motions, Parts parts) {
        super(parts);
        this.motions = motions;
        this.parts = parts;
    }

    @Override
    public void motionStarted(IMotion motion) {
        for (int i = 0; i < motions.length; i++) {
            if (motions[i] == motion) {
                parts.begin(i);
                return;
            }
        }
        parts.begin(0); // a cabinet that reports the batch as a whole
    }

    /** Reports to the listener of every part, each once and in order. */
    private static final class Parts implements MotionJob.Listener {
        private final MotionJob.Listener[] listeners;
        private int at = -1;

        Parts(MotionJob.Listener[] listeners) {
            this.listeners = listeners;
        }

        synchronized void begin(int part) {
            while (at < part) {
                if (at >= 0) {
                    listeners[at].finished(MotionJob.Outcome.DONE, 0, "");
                }
                at++;
                listeners[at].started();
            }
        }

        public void started() {
            begin(0);
        }

        public synchronized void reached(int segment) {
            listeners[Math.max(at, 0)].reached(segment);
        }

        public synchronized void triggered(int trigger) {
            listeners[Math.max(at, 0)].triggered(trigger);
        }

        public synchronized void fired(int node) {
            listeners[Math.max(at, 0)].fired(node);
        }

        public synchronized void finished(MotionJob.Outcome outcome, int code, String text) {
            if (outcome == MotionJob.Outcome.DONE) {
                begin(listeners.length - 1);
            }
            int last = Math.max(at, 0);
            at = listeners.length;
            for (int i = last + 1; i < listeners.length; i++) {
                listeners[i].finished(MotionJob.Outcome.CANCELLED, 0, "");
            }
            listeners[last].finished(outcome, code, text);
        }
    }
}
