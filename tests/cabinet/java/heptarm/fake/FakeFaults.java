package heptarm.fake;

import java.util.concurrent.Semaphore;
import java.util.concurrent.TimeUnit;

import heptarm.core.Clock;

/** Faults and delays to order: slow getters, failing readings, failing commands. */
final class FakeFaults {
    private static final long FAULT_NS = 1500000000L;
    private static final long LONGEST_PLANNING_S = 60;

    final Clock clock;
    private final long getterNanos;
    private final Semaphore planned = new Semaphore(0);
    private volatile long blindUntil;
    private volatile long jammedUntil;
    private volatile long outdatedUntil;
    private volatile boolean lacksSafety;
    /** Stiffness of A1 with which the newest servo motion began [Nm/rad]. */
    volatile double stiffness;

    FakeFaults(Clock clock, long getterNanos) {
        this.clock = clock;
        this.getterNanos = getterNanos;
    }

    /** Order a fault by the text of a message to the operator. */
    void order(String text) {
        switch (text) {
            case "blind" -> blindUntil = clock.nanos() + FAULT_NS;
            case "jammed" -> jammedUntil = clock.nanos() + FAULT_NS;
            case "outdated" -> outdatedUntil = clock.nanos() + FAULT_NS;
            case "lacks safety" -> lacksSafety = true;
            case "planned" -> planned.release();
            case "lacking" -> throw new NoClassDefFoundError("com/kuka/Option");
            case "crash" -> throw new IllegalStateException("an error of the cabinet's API");
            default -> { }
        }
    }

    /** A reading of so many getters: takes their time, and fails while the robot is blind or its release lacks the method. */
    void read(int getters) {
        failUntil(blindUntil);
        if (clock.nanos() < outdatedUntil) {
            throw new NoSuchMethodError("a getter of a later release");
        }
        if (getterNanos > 0) {
            sleep(getters * getterNanos);
        }
    }

    /** A reading of the safety state: fails once if that was ordered. */
    void readSafety() {
        if (lacksSafety) {
            lacksSafety = false;
            throw new NoSuchMethodError("getSafetyState of a later release");
        }
        read(6);
    }

    /** A command: takes as long as a getter, and fails while the robot is jammed. */
    void command() {
        failUntil(jammedUntil);
        if (getterNanos > 0) {
            sleep(getterNanos);
        }
    }

    private void failUntil(long until) {
        if (clock.nanos() < until) {
            throw new IllegalStateException("the controller did not respond");
        }
    }

    /** Plan until the operator orders that it is planned. */
    void plan() {
        try {
            planned.tryAcquire(LONGEST_PLANNING_S, TimeUnit.SECONDS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    void sleep(long nanos) {
        try {
            clock.sleepUntil(clock.nanos() + nanos);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }
}
