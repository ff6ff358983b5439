package heptarm.fake;

import heptarm.core.robot.RobotModels;

/** Prints the model of each device name, or why it is refused. */
public final class ModelProbe {
    private ModelProbe() {
    }

    public static void main(String[] args) {
        for (String name : args) {
            try {
                System.out.println(RobotModels.describe(name, new double[7], new double[7]).model);
            } catch (IllegalArgumentException e) {
                System.out.println(e.getMessage());
            }
        }
    }
}
