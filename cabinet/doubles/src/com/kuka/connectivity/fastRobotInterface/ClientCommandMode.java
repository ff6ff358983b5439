package com.kuka.connectivity.fastRobotInterface;

/** What an FRI client commands. */
public enum ClientCommandMode {
    NO_COMMAND_MODE, POSITION, WRENCH, TORQUE;

    /** The mode of a number as FRI transmits it; of an unknown one {@link #NO_COMMAND_MODE}. */
    public static ClientCommandMode intToVal(int number) {
        return number > 0 && number < values().length ? values()[number] : NO_COMMAND_MODE;
    }
}
