package com.kuka.connectivity.motionModel.smartServo;

/** Called when a servo motion has reached its goal. */
public interface IServoOnGoalReachedEvent {
    void onGoalReachedEvent(String state, double[] currentAxisPos, int[] osTimestamp, int targetId);
}
