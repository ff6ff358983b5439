package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.IOTypes;
import com.kuka.roboticsAPI.ioModel.Output;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

/** A PLC's orders by bits: the number of a position, a start bit, a done bit. */
public class BitOrders extends RoboticsAPIApplication {
    private static final double[][] POSITIONS = {{0, 0.3, 0, -1.2, 0, 0.9, 0}, {0.3, 0.3, 0, -1.2, 0, 0.9, 0.2}};
    @Inject
    private LBR lbr;
    @Inject
    private StationIOGroup plc;

    @Override
    public void run() throws Exception {
        StringBuilder seen = new StringBuilder("BitOrders");
        for (Output oput : plc.getOutputs()) {
            seen.append(' ').append(oput.getIOName()).append(':').append(oput.getDataType()).append(':').append(oput.getBitSize());
            if (oput.getDataType() == IOTypes.BOOLEAN) {
                seen.append(':').append(oput.getBooleanIOValue());
            }
        }
        for (int order = 0; order < POSITIONS.length; order++) {
            plc.setOrder(order);
            plc.setStart(true);
            if (getObserverManager().waitFor(new BooleanIOCondition(plc.getInput("Start"), true), 1, java.util.concurrent.TimeUnit.SECONDS)) {
                plc.setStep(plc.getOrder() + 1);
                lbr.move(ptp(POSITIONS[plc.getOrder()]).setJointVelocityRel(0.8));
            }
            plc.setStart(false);
        }
        plc.setDone(true);
        IMotionContainer stopped = lbr.move(linRel().setZOffset(40).setReferenceFrame(lbr.getRootFrame()).setCartVelocity(100)
                .breakWhen(new BooleanIOCondition(plc.getOutput("Done"), true)));
        seen.append(' ').append(plc.getInputs().size()).append(' ').append(stopped.getFiredBreakConditionInfo() != null);
        Report.line(getApplicationData(), seen.toString());
        lbr.move(ptp(POSITIONS[1]));
        Report.joints(getApplicationData(), "BitOrders", lbr);
    }
}
