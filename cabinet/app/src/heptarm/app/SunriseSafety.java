package heptarm.app;

import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.ResumeMode;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.CommandRejected;
import heptarm.core.robot.SafetyPort;
import heptarm.core.robot.SimulatorProbe;
import heptarm.wire.Code;
import heptarm.wire.OperationMode;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;

/** The safety state of Sunrise behind the core's port, and what an application may do after a stop. */
final class SunriseSafety implements SafetyPort {
    private final LBR lbr;
    private final SunriseExecutionService execution;
    private final IRecovery recovery;
    private final SimulatorProbe probe;

    /** Probe: null on a real robot, whose brakes are then unknown. */
    SunriseSafety(LBR lbr, SunriseExecutionService execution, IRecovery recovery, SimulatorProbe probe) {
        this.lbr = lbr;
        this.execution = execution;
        this.recovery = recovery;
        this.probe = probe;
    }

    public SafetyState read(long stamp) {
        ISafetyState safety = lbr.getSafetyState();
        int bits = probe == null ? 0 : probe.safetyBits();
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
        bits |= recovery != null && recovery.isRecoveryRequired() ? SafetyBits.RECOVERY_REQUIRED : 0;
        return new SafetyState(stamp, bits, mode(lbr.getOperationMode()));
    }

    private static OperationMode mode(com.kuka.roboticsAPI.deviceModel.OperationMode mode) {
        if (mode == com.kuka.roboticsAPI.deviceModel.OperationMode.AUT) {
            return OperationMode.AUT;
        }
        return mode == com.kuka.roboticsAPI.deviceModel.OperationMode.T2 ? OperationMode.T2 : OperationMode.T1;
    }

    /** Acknowledges errors and resumes on the path; the cabinet moves a displaced arm back to it. */
    public void recover() throws CommandRejected {
        try {
            if (lbr.getController() instanceof SunriseController) {
                ((SunriseController) lbr.getController()).acknowledgeError();
            }
            if (execution.isPaused()) {
                execution.resumeExecution(ResumeMode.OnPath);
            }
        } catch (RuntimeException e) {
            throw new CommandRejected(Code.NEEDS_OPERATOR, "the cabinet does not resume: " + e.getMessage()
                    + "; follow the instructions on the smartPAD, then press Start");
        }
    }
}
