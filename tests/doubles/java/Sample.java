package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.List;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.TimeoutException;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

/** Written as a Sunrise programmer writes; each step leaves a line that the test reads. */
public class Sample extends RoboticsAPIApplication implements IErrorHandler {
    @Inject
    private LBR lbr;

    private PrintWriter out;
    private volatile IMotionContainer failed;
    private volatile int cancelled = -1;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
        getApplicationControl().registerMoveAsyncErrorHandler(this);
        say("initialize", lbr.getName());
    }

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.5));
        say("ptp", lbr.getCurrentJointPosition().isNearlyEqual(new JointPosition(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0), 1e-4));

        Frame before = lbr.getCurrentCartesianPosition(lbr.getFlange());
        lbr.move(linRel(0, 0, -100, World.Current.getRootFrame()).setCartVelocity(200));
        Frame after = lbr.getCurrentCartesianPosition(lbr.getFlange());
        say("linRel down 100 mm", Math.abs(before.getZ() - after.getZ() - 100) < 0.1 && before.distanceTo(after) < 100.1);

        lbr.move(lin(before).setCartVelocity(200));
        say("lin back", lbr.getCurrentCartesianPosition(lbr.getFlange()).distanceTo(before) < 0.1);

        lbr.move(linRel(0, 0, 50));
        say("linRel moves along the flange's own axes",
                Math.abs(before.transformationTo(lbr.getCurrentCartesianPosition(lbr.getFlange())).getZ() - 50) < 0.1);

        IMotionContainer first = lbr.moveAsync(ptp(0.4, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.05));
        IMotionContainer second = lbr.moveAsync(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0));
        say("moveAsync returns before the motion has ended", !first.isFinished());
        second.await();
        say("queued motions run in order", first.isFinished() && second.isFinished() && !second.hasError());

        IMotionContainer long1 = lbr.moveAsync(ptp(1.5, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.2));
        try {
            long1.await(300, TimeUnit.MILLISECONDS);
            say("await with a time-out", false);
        } catch (TimeoutException e) {
            say("await with a time-out", true);
        }
        long1.cancel();
        long1.await();
        double a1 = lbr.getCurrentJointPosition().get(0);
        say("cancel brakes on the path", long1.isFinished() && !long1.hasError() && a1 > 0.01 && a1 < 1.4);

        lbr.move(positionHold(new PositionControlMode(), 100, TimeUnit.MILLISECONDS));
        say("positionHold", true);

        try {
            lbr.move(ptp(0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0));
            say("a joint limit throws", false);
        } catch (CommandInvalidException e) {
            say("a joint limit throws", e.getMessage().contains("violates limit A2"));
        }
        try {
            ptp(0, 0, 0, 0, 0, 0, 0).setJointVelocityRel(1.5);
            say("a bad parameter throws", false);
        } catch (IllegalArgumentException e) {
            say("a bad parameter throws", true);
        }
        try {
            getApplicationData().getProcessData("no.such.data");
            say("unknown process data throws", false);
        } catch (PersistenceException e) {
            say("unknown process data throws", true);
        }

        IMotionContainer running = lbr.moveAsync(ptp(0.6, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.5));
        IMotionContainer bad = lbr.moveAsync(linRel(5000, 0, 0, World.Current.getRootFrame()));
        running.await();
        for (int i = 0; i < 200 && failed == null; i++) {
            Thread.sleep(10);
        }
        say("an asynchronous error reaches the handler", failed == bad && bad.hasError() && cancelled == 0);
        say("the application goes on", lbr.isReadyToMove());
        lbr.move(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0));
        say("and moves", true);
    }

    @Override
    public ErrorHandlingAction handleError(Device device, IMotionContainer container, List<IMotionContainer> canceled) {
        failed = container;
        cancelled = canceled.size();
        return ErrorHandlingAction.Ignore;
    }

    @Override
    public void dispose() {
        say("dispose", true);
        out.close();
        super.dispose();
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
