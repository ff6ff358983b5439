package heptarm.core.robot;

/**
 * A motion container of a cabinet as a job: what containers of every API generation have in common.
 *
 * It ends once, whichever of its events comes first, and what is cancelled before the cabinet has answered is
 * cancelled as soon as it has. All methods: any thread.
 */
public abstract class ContainerJob implements MotionJob {
    protected final MotionJob.Listener listener;
    private boolean accepted;
    private boolean cancelled;
    private boolean ended;

    protected ContainerJob(MotionJob.Listener listener) {
        this.listener = listener;
    }

    /** Cancel the container; called only after accepted(). */
    protected abstract void cancelContainer();

    /** To be called once the container is known. */
    protected final void accepted() {
        boolean late;
        synchronized (this) {
            accepted = true;
            late = cancelled;
        }
        if (late) {
            cancelContainer();
        }
    }

    public final void cancel() {
        synchronized (this) {
            cancelled = true;
            if (ended || !accepted) {
                return;
            }
        }
        cancelContainer();
    }

    /** Whether the job has ended. */
    public final synchronized boolean isOver() {
        return ended;
    }

    /** End the job with the cabinet's reason, or null where it reports none. */
    public final void fail(String text) {
        String why = text == null ? "the cabinet reports no reason" : text;
        end(Outcome.FAILED, FailureTexts.code(why), why);
    }

    /** End the job: done, or cancelled where that was asked for. */
    protected final void finish() {
        boolean wasCancelled;
        synchronized (this) {
            wasCancelled = cancelled;
        }
        end(wasCancelled ? Outcome.CANCELLED : Outcome.DONE, 0, "");
    }

    protected final void end(Outcome outcome, int code, String text) {
        synchronized (this) {
            if (ended) {
                return;
            }
            ended = true;
        }
        listener.finished(outcome, code, text);
    }
}
