package heptarm.core.safety;

import heptarm.wire.OperationMode;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;

/** What a safety state means for motions and for the operator. */
final class SafetyAssessment {
    private static final int STOPS = SafetyBits.EMERGENCY_STOP | SafetyBits.OPERATOR_SAFETY_OPEN | SafetyBits.PROTECTIVE_STOP;

    final SafetyState state;

    SafetyAssessment(SafetyState state) {
        this.state = state;
    }

    private boolean has(int bit) {
        return (state.bits & bit) != 0;
    }

    /** Whether the cabinet reports its safety state. */
    private boolean isKnown() {
        return !has(SafetyBits.UNKNOWN);
    }

    boolean differsFrom(SafetyAssessment other, int ignored) {
        return ((state.bits ^ other.state.bits) & ~ignored) != 0 || state.mode != other.state.mode;
    }

    /** Whether the mode requires an enabling switch and none is pressed. */
    boolean lacksEnabling() {
        return isKnown() && state.mode != OperationMode.AUT && !has(SafetyBits.ENABLING_SWITCH);
    }

    /** Whether a stop is active; the stop that a released enabling switch causes does not count. */
    boolean isStop() {
        return (state.bits & (lacksEnabling() ? STOPS & ~SafetyBits.PROTECTIVE_STOP : STOPS)) != 0;
    }

    /** Whether no motion may begin. */
    boolean isHolding() {
        return isStop() || lacksEnabling();
    }

    boolean isReady() {
        return has(SafetyBits.READY_TO_MOVE) && !has(SafetyBits.PAUSED);
    }

    /** Whether only an error to acknowledge and a pause to end are left. */
    boolean isAcknowledgeable() {
        return !has(SafetyBits.EMERGENCY_STOP) && !has(SafetyBits.OPERATOR_SAFETY_OPEN) && !lacksEnabling()
                && has(SafetyBits.MASTERED);
    }

    /** What an operator has to do, step by step; empty: nothing. */
    String steps() {
        if (!isKnown()) {
            return "look at the smartPAD: this cabinet reports no safety state";
        }
        StringBuilder steps = new StringBuilder();
        if (has(SafetyBits.EMERGENCY_STOP)) {
            step(steps, "release the emergency stop and acknowledge it at the smartPAD");
        }
        if (has(SafetyBits.OPERATOR_SAFETY_OPEN)) {
            step(steps, "close the safeguard and acknowledge it beside the cell");
        }
        if (lacksEnabling()) {
            step(steps, "hold the enabling switch of the smartPAD (the mode is " + state.mode + ")");
        } else if (has(SafetyBits.PROTECTIVE_STOP) && steps.length() == 0) {
            step(steps, "remove the cause of the safety stop and acknowledge it at the smartPAD");
        }
        if (!has(SafetyBits.MASTERED)) {
            step(steps, "master the axes at the smartPAD");
        }
        return steps.toString();
    }

    private static void step(StringBuilder steps, String text) {
        steps.append(steps.length() > 0 ? "; " : "").append(text);
    }

    /** Why motions end. */
    String reason() {
        if (has(SafetyBits.EMERGENCY_STOP)) {
            return "the emergency stop was pressed";
        }
        if (has(SafetyBits.OPERATOR_SAFETY_OPEN)) {
            return "the safeguard was opened";
        }
        return lacksEnabling() ? "the enabling switch is not held (the mode is " + state.mode + ")"
                : "a safety function requested a stop";
    }

    /** The state in a sentence. */
    String summary() {
        if (!isKnown()) {
            return "the safety state is unknown: this cabinet reports none";
        }
        if (isHolding()) {
            return reason();
        }
        if (isReady()) {
            return "the robot is ready to move";
        }
        return has(SafetyBits.PAUSED) ? "execution is paused" : "the robot is not ready to move";
    }
}
