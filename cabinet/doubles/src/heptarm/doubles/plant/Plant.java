package heptarm.doubles.plant;

import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.ImpedanceMode;
import heptarm.doubles.seam.FriSessionSettings;
import heptarm.doubles.seam.MotionOrder;
import heptarm.doubles.seam.AttachedLoad;
import heptarm.doubles.seam.CarriedBodies;
import heptarm.doubles.seam.RobotDescription;

/** The simulated robot, implemented in Python. Methods may be called from any thread. */
public interface Plant {
    /** The robot's name, limits and dimensions, read by {@link RobotDescription#decode}. */
    byte[] describe();

    /** Plans and queues a motion; returns null on success, otherwise the reason for the refusal, in Sunrise's words. */
    String submit(MotionOrder order, MotionListener listener);

    void cancel(long id);

    void cancelAll();

    /** Cancels everything; the running motion leaves its path and every axis brakes with full deceleration. */
    void stopFast();

    void pause();

    void resume();

    /** Acknowledges errors whose cause is gone. */
    void acknowledge();

    /** Limits the manual override of the smartPAD to a maximum. */
    void clipManualOverride(double limit);

    /** Changes the parameters of a running motion's control mode. */
    void changeMode(long id, ImpedanceMode mode);

    /**
     * Monitors a condition until {@link #unwatch}, independent of motions; returns its number, never 0.
     *
     * @param atOnce also report a condition that holds from the beginning
     */
    long watch(Condition condition, boolean atOnce, ConditionListener listener);

    void unwatch(long number);

    /** Place of a signal in the IO image, see {@link SharedState#signal}; assigned at the first call. */
    int signal(String name, boolean output);

    /**
     * Inverse kinematics: the joint positions [rad] nearest to others that reach a flange pose in the base; null if there are none.
     *
     * @param e1 the angle of A3 [rad]; NaN: any
     * @param status status of the posture; -1: any
     */
    double[] inverse(double[] pose, double e1, int status, double[] near);

    /** Opens an FRI session to a client; returns its number. */
    long friOpen(FriSessionSettings settings, FriChannel channel);

    void friClose(long session);

    /** Sets the load data of everything attached to the flange. */
    void setAttachedLoad(AttachedLoad load);

    /**
     * Sets the load that the safety functions count on the flange: tools and the safety workpiece.
     *
     * @param workpiece mass of the safety workpiece [kg], 0: none; refused beyond what the safety configuration allows
     */
    void setSafetyLoad(AttachedLoad load, double workpiece);

    /** Sets the shapes of everything attached to the flange; they collide from the next tick on. */
    void setCarriedBodies(CarriedBodies carried);
}
