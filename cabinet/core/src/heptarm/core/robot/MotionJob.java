package heptarm.core.robot;

/** A motion that the robot has accepted. */
public interface MotionJob {
    /** Brakes on the path if the motion is running, removes it from the queue otherwise. Any thread, any number of times. */
    void cancel();

    /** Receives the events of a job in the robot's threads; must not block. */
    interface Listener {
        void started();

        /** A segment of a spline begins. */
        void reached(int segment);

        /** The trigger at an index has fired; its action may take as long as a few calls to the robot. */
        void triggered(int trigger);

        /** The break condition at a node index has fired. May come twice, or only at the end of the job. */
        void fired(int node);

        /**
         * The job has ended.
         *
         * @param outcome how it ended
         * @param code code of a failure, 0 otherwise
         * @param text the robot's text on a failure
         */
        void finished(Outcome outcome, int code, String text);
    }

    /** How a job ended. */
    enum Outcome { DONE, CANCELLED, CONDITION, FAILED }
}
