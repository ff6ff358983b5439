package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import java.util.LinkedList;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** Moves to taught frames; what to do there is in their additional parameters. */
public class TaughtLine extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;
    private final StringBuilder done = new StringBuilder();

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0, 0.5, 0, -1.4, 0, 1.2, 0).setJointVelocityRel(0.7));
        LinkedList<Frame> frameList = new LinkedList<Frame>();
        for (ObjectFrame one : getApplicationData().getFrame("/Table").getChildrenSnapshot()) {
            frameList.add(one.copyWithRedundancy());
            done.append(one.getPath()).append(' ').append(one.getName()).append(' ');
        }
        Frame taught = new Frame(lbr.getRootFrame(), 0, 0, 0, 0, 0, 0);
        taught.setAdditionalParameter("WAIT", 3);
        for (Frame targetFrame : frameList) {
            Frame above = targetFrame.copyWithRedundancy().transform(Transformation.ofTranslation(0, 0, -60));
            lbr.move(ptp(above).setJointVelocityRel(0.6));
            lbr.move(lin(targetFrame).setCartVelocity(150));
            if (targetFrame.hasAdditionalParameter("PICK")) {
                done.append("pick ").append((Object) targetFrame.getAdditionalParameter("Comment")).append(' ');
                double e1 = ((LBRE1Redundancy) targetFrame.getRedundancyInformationForDevice(lbr)).getE1();
                done.append(Math.abs(lbr.getCurrentJointPosition().get(2) - e1) < 1e-3).append(' ');
            } else if (targetFrame.hasAdditionalParameter("PLACE")) {
                done.append("place ");
            }
            AbstractFrame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
            done.append(here.isCloseTo(targetFrame, 0.1, 1e-3)).append(' ');
        }
        boolean isText = frameList.getLast().toStringTrafo().equals(frameList.getLast().getTransformationFromParent().toString());
        done.append(isText).append(' ').append(taught.hasAdditionalParameter("WAIT")).append(' ').append(taught.getPath().isEmpty());
        Report.line(getApplicationData(), "TaughtLine " + done);
    }
}
