package com.kuka.connectivity.fastRobotInterface;

/** Quantity that an FRI client commands. */
public enum ClientCommandMode {
    NO_COMMAND_MODE, POSITION, WRENCH, TORQUE;

    /** The mode with FRI's number; {@link #NO_COMMAND_MODE} for an unknown number. */
    public static ClientCommandMode intToVal(int number) {
        return number > 0 && number < values().length ? values()[number] : NO_COMMAND_MODE;
    }
}
