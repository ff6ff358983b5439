package heptarm.core.robot;

import heptarm.wire.Code;

/** What the texts of a cabinet mean: it reports failures of motions as texts only. */
public final class FailureTexts {
    private FailureTexts() {
    }

    /** The code of a failure. */
    public static int code(String text) {
        if (text.indexOf("safety stop") >= 0) {
            return Code.SAFETY_STOP;
        }
        if (text.indexOf("singularity") >= 0) {
            return text.indexOf("Can not plan") >= 0 ? Code.PLANNING_FAILED : Code.EXECUTION_FAILED;
        }
        if (text.indexOf("violates limit") >= 0) {
            return Code.JOINT_LIMIT;
        }
        if (text.indexOf("not reachable") >= 0) {
            return Code.UNREACHABLE;
        }
        return text.indexOf("Can not plan") >= 0 ? Code.PLANNING_FAILED : Code.EXECUTION_FAILED;
    }
}
