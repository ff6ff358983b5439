package heptarm.app;

import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Insight;
import heptarm.core.Refusal;
import heptarm.wire.Code;
import heptarm.wire.OperationMode;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;

/** The safety state of Sunrise on the wire's terms, and what an application may do after a stop. */
final class SunriseSafety {
    private final LBR lbr;
    private final SunriseExecutionService execution;
    private final Insight insight;
    private volatile IRecovery recovery;

    /** Without a simulator's insight nothing is known of the brakes. */
    SunriseSafety(LBR lbr, SunriseExecutionService execution, Insight insight) {
        this.lbr = lbr;
        this.execution = execution;
        this.insight = insight;
    }

    void heed(IRecovery told) {
        recovery = told;
    }

    SafetyState read(long stamp) {
        ISafetyState safety = lbr.getSafetyState();
        int bits = insight == null ? 0 : insight.safetyBits();
        bits |= lbr.isReadyToMove() ? SafetyBits.READY_TO_MOVE : 0;
        bits |= execution.isPaused() ? SafetyBits.PAUSED : 0;
        bits |= lbr.hasActiveMotionCommand() ? SafetyBits.MOVING : 0;
        bits |= lbr.isMastered() ? SafetyBits.MASTERED : 0;
        boolean emergency = safety.getEmergencyStopInt() == SunriseSafetyState.EmergencyStop.ACTIVE
                || safety.getEmergencyStopEx() == SunriseSafetyState.EmergencyStop.ACTIVE;
        bits |= emergency ? SafetyBits.EMERGENCY_STOP : 0;
        bits |= safety.getSafetyStopSignal() != SunriseSafetyState.SafetyStopType.NOSTOP ? SafetyBits.PROTECTIVE_STOP : 0;
        bits |= safety.getOperatorSafetyState() != SunriseSafetyState.OperatorSafety.OPERATOR_SAFETY_CLOSED
                ? SafetyBits.OPERATOR_SAFETY_OPEN : 0;
        bits |= safety.getEnablingDeviceState() != SunriseSafetyState.EnablingDeviceState.NONE ? SafetyBits.ENABLING_SWITCH : 0;
        bits |= safety.getEnablingDeviceState() == SunriseSafetyState.EnablingDeviceState.HANDGUIDING
                ? SafetyBits.HAND_GUIDING_SWITCH : 0;
        bits |= safety.areAllAxesGMSReferenced() ? SafetyBits.TORQUE_REFERENCED : 0;
        bits |= safety.areAllAxesPositionReferenced() ? SafetyBits.POSITION_REFERENCED : 0;
        IRecovery told = recovery;
        bits |= told != null && told.isRecoveryRequired() ? SafetyBits.RECOVERY_REQUIRED : 0;
        return new SafetyState(stamp, bits, mode(lbr.getOperationMode()));
    }

    private static OperationMode mode(com.kuka.roboticsAPI.deviceModel.OperationMode mode) {
        if (mode == com.kuka.roboticsAPI.deviceModel.OperationMode.AUT) {
            return OperationMode.AUT;
        }
        return mode == com.kuka.roboticsAPI.deviceModel.OperationMode.T2 ? OperationMode.T2 : OperationMode.T1;
    }

    /** Acknowledges errors and lets execution go on along the path; the cabinet brings a displaced arm back to it. */
    void recover() throws Refusal {
        try {
            if (lbr.getController() instanceof SunriseController) {
                ((SunriseController) lbr.getController()).acknowledgeError();
            }
            if (execution.isPaused()) {
                execution.resumeExecution(ResumeMode.OnPath);
            }
        } catch (RuntimeException e) {
            throw new Refusal(Code.NEEDS_OPERATOR, "the cabinet does not go on: " + e.getMessage()
                    + "; do what the smartPAD shows, and press Start");
        }
    }
}
