package heptarm.fake;

import heptarm.core.robot.SafetyPort;
import heptarm.wire.OperationMode;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;

/** Safety state that messages to the operator change. */
final class FakeSafety implements SafetyPort {
    private final FakeFaults faults;
    volatile boolean paused;
    private volatile int bits;
    private volatile OperationMode mode = OperationMode.AUT;

    FakeSafety(FakeFaults faults) {
        this.faults = faults;
    }

    boolean isStopped() {
        return bits != 0 && bits != SafetyBits.ENABLING_SWITCH || mode != OperationMode.AUT && bits == 0;
    }

    @Override
    public SafetyState read(long stamp) {
        faults.readSafety();
        int all = bits | SafetyBits.MASTERED | (paused ? SafetyBits.PAUSED : 0);
        return new SafetyState(stamp, isStopped() ? all : all | SafetyBits.READY_TO_MOVE, mode);
    }

    /** Acknowledges a safety stop whose cause needs no operator. */
    @Override
    public void recover() {
        bits &= ~SafetyBits.PROTECTIVE_STOP;
        paused = false;
    }

    /** What happens at the smartPAD; a stop pauses, as on the cabinet. */
    void operate(String what) {
        switch (what) {
            case "emergency stop" -> bits = SafetyBits.EMERGENCY_STOP | SafetyBits.PROTECTIVE_STOP;
            case "safeguard" -> bits = SafetyBits.OPERATOR_SAFETY_OPEN | SafetyBits.PROTECTIVE_STOP;
            case "safety stop" -> bits = SafetyBits.PROTECTIVE_STOP;
            case "release" -> bits = 0;
            case "enable" -> bits = SafetyBits.ENABLING_SWITCH;
            case "T1" -> mode = OperationMode.T1;
            default -> mode = OperationMode.AUT;
        }
        paused = paused || bits != SafetyBits.ENABLING_SWITCH;
    }
}
