package cell;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.batch;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.util.List;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.generated.ioAccess.CellIOGroup;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.task.ITaskLogger;

/** Moves parts from one side of a table to the other, and sets them down gently. */
public class PickAndPlace extends RoboticsAPIApplication {
    private static final double ABOVE = 80.0; // [mm]
    private static final double TOUCH = 15.0; // [N]

    @Inject
    private LBR lbr;
    @Inject
    private CellIOGroup io;
    @Inject
    private IApplicationData data;
    @Inject
    private ITaskLogger logger;
    @Inject
    @Named("Gripper")
    private Gripper gripper;
    @Inject
    @Named("cell.speed")
    private IProcessData speed;

    private final CartesianImpedanceControlMode compliant = new CartesianImpedanceControlMode();
    private ICounter counter;

    @Override
    public void initialize() {
        compliant.parametrize(CartDOF.Z).setStiffness(500);
        gripper.attachTo(lbr.getFlange());
        lbr.setHomePosition(new JointPosition(0, 0.4, 0, -1.4, 0, 1.3, 0));
        counter = getTaskFunction(ICounter.class);
        getApplicationControl().registerMoveAsyncErrorHandler(new IErrorHandler() {
            @Override
            public ErrorHandlingAction handleError(Device device, IMotionContainer failed, List<IMotionContainer> cancelled) {
                logger.error("a motion failed: " + failed.getErrorMessage());
                return ErrorHandlingAction.EndApplication;
            }
        });
    }

    @Override
    public void run() {
        lbr.move(ptp(0, 0.4, 0, -1.4, 0, 1.3, 0).setJointVelocityRel(0.5));
        int parts = data.getProcessData("cell.parts").getValue();
        for (int i = 1; i <= parts; i++) {
            pick(data.<Workpiece>createFromTemplate("Part"));
            place();
            io.setPlaced((long) i);
        }
        logger.info(io.getPlaced() + " parts are placed, the gripper closed " + counter.closings() + " times");
    }

    private double speed() {
        return speed.<Double>getValue();
    }

    private Frame above(ObjectFrame frame) {
        Frame above = frame.copyWithRedundancy();
        above.transform(Transformation.ofTranslation(0, 0, -ABOVE)); // its z axis points down
        return above;
    }

    private void pick(Workpiece part) {
        ObjectFrame from = data.getFrame("/Table/Pick");
        gripper.move(new MotionBatch(ptp(above(from)).setJointVelocityRel(0.6), lin(from).setCartVelocity(speed())).setBlendingCart(20));
        gripper.grip(io, part);
        gripper.move(linRel(0, 0, -ABOVE).setCartVelocity(speed()));
    }

    private void place() {
        ObjectFrame to = data.getFrame("/Table/Place");
        gripper.move(batch(lin(above(to)).setCartVelocity(2 * speed()), lin(to).setCartVelocity(speed())).setBlendingCart(20));
        ForceCondition touched = ForceCondition.createSpatialForceCondition(gripper.getDefaultMotionFrame(), TOUCH);
        IMotionContainer down = gripper.move(linRel(0, 0, 5).setCartVelocity(20).setMode(compliant).breakWhen(touched));
        logger.fine(down.hasFired(touched) ? "touched the table" : "nothing was touched");
        gripper.release(io);
        gripper.move(linRel(0, 0, -ABOVE).setCartVelocity(speed()));
    }

    @Override
    public void dispose() {
        gripper.detach();
        super.dispose();
    }
}
