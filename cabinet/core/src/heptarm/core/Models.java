package heptarm.core;

import heptarm.wire.RobotInfo;

/** Figures of the robots that the cabinet's API does not tell: data-sheet velocities and torques. */
public final class Models {
    private static final double[] SPEED_7 = {98, 98, 100, 130, 140, 180, 180};
    private static final double[] SPEED_14 = {85, 85, 100, 75, 130, 135, 135};
    private static final double[] TORQUE_7 = {176, 176, 110, 110, 110, 40, 40};
    private static final double[] TORQUE_14 = {320, 320, 176, 176, 110, 40, 40};

    private Models() {
    }

    /** The robot whose device name is like LBR_iiwa_14_R820_1, with the limits that the cabinet tells. */
    public static RobotInfo describe(String deviceName, double[] qMin, double[] qMax) {
        boolean small = deviceName.indexOf("_7_") >= 0 || deviceName.indexOf("R800") >= 0;
        boolean medical = deviceName.toLowerCase().indexOf("med") >= 0;
        String model = (medical ? "med" : "iiwa") + (small ? "7" : "14");
        String title = "LBR " + (medical ? "Med" : "iiwa") + (small ? " 7 R800" : " 14 R820");
        double[] speed = (small ? SPEED_7 : SPEED_14).clone();
        for (int i = 0; i < speed.length; i++) {
            speed[i] = Math.toRadians(speed[i]);
        }
        return new RobotInfo(model, title, qMin, qMax, speed, (small ? TORQUE_7 : TORQUE_14).clone());
    }
}
