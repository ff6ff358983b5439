package heptarm.core.robot;

import java.util.Locale;

import heptarm.wire.RobotInfo;

/** Robot models with the figures that the cabinet's API does not provide: data-sheet velocities and torques. */
public final class RobotModels {
    private static final double[] SPEED_7 = {98, 98, 100, 130, 140, 180, 180};
    private static final double[] SPEED_14 = {85, 85, 100, 75, 130, 135, 135};
    private static final double[] TORQUE_7 = {176, 176, 110, 110, 110, 40, 40};
    private static final double[] TORQUE_14 = {320, 320, 176, 176, 110, 40, 40};
    private static final String MEDICAL = "med";
    private static final RobotModels[] KNOWN = {
        new RobotModels("iiwa7", "LBR iiwa 7 R800", SPEED_7, TORQUE_7, "_7_", "r800"),
        new RobotModels("iiwa14", "LBR iiwa 14 R820", SPEED_14, TORQUE_14, "_14_", "r820"),
        new RobotModels("med7", "LBR Med 7 R800", SPEED_7, TORQUE_7, "_7_", "r800"),
        new RobotModels("med14", "LBR Med 14 R820", SPEED_14, TORQUE_14, "_14_", "r820"),
    };

    private final String model;
    private final String title;
    /** [deg/s]. */
    private final double[] speed;
    /** [Nm]. */
    private final double[] torque;
    /** Parts of a device name that identify the payload class, in lower case. */
    private final String[] marks;

    private RobotModels(String model, String title, double[] speed, double[] torque, String... marks) {
        this.model = model;
        this.title = title;
        this.speed = speed;
        this.torque = torque;
        this.marks = marks;
    }

    /**
     * Describe the robot with a device name such as LBR_iiwa_14_R820_1.
     *
     * @param qMin lower joint limits that the cabinet reports [rad]
     * @param qMax upper joint limits that the cabinet reports [rad]
     * @throws IllegalArgumentException the name belongs to no known model
     */
    public static RobotInfo describe(String deviceName, double[] qMin, double[] qMax) {
        String name = deviceName.toLowerCase(Locale.ENGLISH);
        StringBuilder titles = new StringBuilder();
        for (RobotModels one : KNOWN) {
            if (one.model.startsWith(MEDICAL) == name.indexOf(MEDICAL) >= 0 && one.isMarked(name)) {
                return one.info(qMin, qMax);
            }
            titles.append(titles.length() == 0 ? "" : ", ").append(one.title);
        }
        throw new IllegalArgumentException("robot " + deviceName + " is not supported; the device name must contain a known model,"
                + " as in LBR_iiwa_14_R820_1 (known models: " + titles + "); correct the device name in the station setup");
    }

    private boolean isMarked(String name) {
        for (String mark : marks) {
            if (name.indexOf(mark) >= 0) {
                return true;
            }
        }
        return false;
    }

    private RobotInfo info(double[] qMin, double[] qMax) {
        double[] radians = new double[speed.length];
        for (int i = 0; i < radians.length; i++) {
            radians[i] = Math.toRadians(speed[i]);
        }
        return new RobotInfo(model, title, qMin, qMax, radians, torque.clone());
    }
}
