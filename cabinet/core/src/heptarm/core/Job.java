package heptarm.core;

/** A motion that the robot has accepted. */
public interface Job {
    /** Brakes on the path if it runs, leaves the queue otherwise. May be called from any thread, more than once. */
    void cancel();

    /** Hears of a job. Called from threads of the robot; must not block. */
    interface Listener {
        void started();

        /** A segment of a spline begins. */
        void reached(int segment);

        /** A trigger has fired, the one of that index; its action may take the time of some calls to the robot. */
        void triggered(int trigger);

        /** One of the job's break conditions has fired: the node of that index. It may be told of twice, or once, at the end. */
        void fired(int node);

        /**
         * The job has ended.
         *
         * @param ended how
         * @param code code of a failure, 0 otherwise
         * @param text the robot's words on a failure
         */
        void finished(Ended ended, int code, String text);
    }

    /** How a job ended. */
    enum Ended { DONE, CANCELLED, CONDITION, FAILED }
}
