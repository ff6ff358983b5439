package com.kuka.sensitivity;

import com.kuka.device.ForceData;
import com.kuka.device.common.JointPosition;
import com.kuka.geometry.LocalFrame;
import com.kuka.geometry.ObjectFrame;
import com.kuka.roboticsAPI.deviceModel.TorqueData;

import heptarm.doubles2.Behind;
import heptarm.doubles2.Capabilities;
import heptarm.doubles2.Limits;

/** The robot. Options are its capabilities. */
public final class LBR {
    private final heptarm.sunrise1.roboticsAPI.deviceModel.LBR behind = Behind.robot();

    public JointPosition getCurrentJointPosition() {
        return new JointPosition(behind.getCurrentJointPosition().getInternalArray());
    }

    public LocalFrame getCurrentCartesianPosition(ObjectFrame frame, ObjectFrame reference) {
        return new LocalFrame(reference,
                Behind.transformation(behind.getCurrentCartesianPosition(frame.behind, reference.behind).getTransformationFromParent()));
    }

    public Limits getJointLimits() {
        return new Limits(behind.getJointLimits());
    }

    public TorqueData getExternalTorque() {
        return new TorqueData(behind.getExternalTorque().getTorqueValues());
    }

    public ForceData getExternalForceTorque(ObjectFrame frame) {
        heptarm.sunrise1.roboticsAPI.sensorModel.ForceSensorData found = behind.getExternalForceTorque(frame.behind);
        return new ForceData(Behind.vector(found.getForce()), Behind.vector(found.getTorque()));
    }

    public boolean hasActiveMotionCommand() {
        return behind.hasActiveMotionCommand();
    }

    public ObjectFrame getFlange() {
        return new ObjectFrame(behind.getFlange());
    }

    public ObjectFrame getRootFrame() {
        return new ObjectFrame(behind.getRootFrame());
    }

    public <T> T getCapability(Class<T> type) {
        return Capabilities.of(type);
    }
}
