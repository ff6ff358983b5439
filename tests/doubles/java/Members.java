package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.batch;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.splRel;

import java.io.PrintWriter;
import java.util.Map;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicReference;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.common.params.IParameter;
import com.kuka.common.params.IParameterSet;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ConditionObserver;
import com.kuka.roboticsAPI.conditionModel.ICallbackAction;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.IRisingEdgeListener;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.NotCondition;
import com.kuka.roboticsAPI.conditionModel.NotificationType;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.positionMastering.MasteringInfo;
import com.kuka.roboticsAPI.controllerModel.sunrise.positionMastering.PositionMastering;
import com.kuka.roboticsAPI.deviceModel.CartesianVelocityLimitInfo;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.PositionInformation;
import com.kuka.roboticsAPI.executionModel.IFiredTriggerInfo;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.math.MatrixRotation;
import com.kuka.roboticsAPI.geometricModel.math.MatrixTransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;
import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;
import com.kuka.roboticsAPI.motionModel.HandGuidingMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.PositionHold;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;
import com.kuka.roboticsAPI.persistenceModel.IPersistenceEngine;
import com.kuka.roboticsAPI.persistenceModel.XmlApplicationDataSource;
import com.kuka.roboticsAPI.sensorModel.CartesianPositionInformation;
import com.kuka.roboticsAPI.sensorModel.SensorForExternalForce;
import com.kuka.roboticsAPI.sensorModel.SensorForExternalTorque;
import com.kuka.roboticsAPI.sensorModel.SensorForMeasuredTorque;
import com.kuka.roboticsAPI.sensorModel.TorqueSensorData;
import com.kuka.flexfellow.AbstractFlexFellow;
import com.kuka.med.deviceModel.LBRMed;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationData;
import com.kuka.roboticsAPI.deviceModel.MobilePlatform;
import com.kuka.roboticsAPI.deviceModel.PoseInformation;
import com.kuka.roboticsAPI.geometricModel.ITransformationProvider;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.motionModel.RelativeSPL;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.persistenceModel.templateModel.FramesTemplate;
import com.kuka.roboticsAPI.persistenceModel.templateModel.GeometricObjectTemplate;
import com.kuka.roboticsAPI.persistenceModel.templateModel.TemplateElement;
import com.kuka.roboticsAPI.persistenceModel.templateModel.ToolTemplate;
import com.kuka.roboticsAPI.uiModel.ITaskUI;

/** Members that few applications use; each step leaves a line that the test reads. */
public class Members extends RoboticsAPIApplication {
    /** Types that applications only name. */
    private static final Class<?>[] NAMED = {CartesianVelocityLimitInfo.class, CartesianPositionInformation.class,
        TemplateElement.class, FramesTemplate.class, GeometricObjectTemplate.class, ToolTemplate.class, MobilePlatform.class,
        RoboticsAPIApplicationData.class, PoseInformation.class, AbstractFlexFellow.class, LBRMed.class};

    /** A condition of the application's own, without `and`. */
    private static final class Own implements ICondition {
        @Override
        public ICondition or(ICondition other, ICondition... more) {
            return this;
        }

        @Override
        public ICondition xor(ICondition other) {
            return this;
        }

        @Override
        public ICondition invert() {
            return this;
        }
    }

    /** As the export of an IO group looks. */
    private static final class Mocked extends AbstractIOGroup {
        Mocked(Controller controller) {
            super(controller, "Mocked");
            addMockedDigitalOutput("Lamp", IOTypes.BOOLEAN, 1);
        }

        void light(boolean on) {
            setDigitalOutput("Lamp", on);
        }
    }

    @Inject
    @Named("LBR_iiwa_14_R820_1")
    private LBR lbr;
    private PrintWriter out;

    private void say(String what, boolean truth) {
        out.println(what + " = " + truth);
        out.flush();
    }

    /** The sensors of the arm report what the arm does. */
    private void sensors() {
        SensorForMeasuredTorque measured = lbr.getSensorForMeasuredTorque();
        SensorForExternalTorque external = lbr.getSensorForExternalTorque();
        SensorForExternalForce force = lbr.getSensorForExternalForce();
        say("a sensor of measured torques", isNear(measured.getSensorData(), lbr.getMeasuredTorque()));
        say("a sensor of external torques", isNear(external.getSensorData(), lbr.getExternalTorque()));
        double z = lbr.getExternalForceTorque(lbr.getFlange()).getForce().getZ();
        say("a sensor of the external force", Math.abs(force.getSensorData().getForce().getZ() - z) < 1.0);
    }

    private static boolean isNear(TorqueSensorData one, TorqueSensorData other) {
        return Math.abs(one.getSingleTorqueValue(JointEnum.J2) - other.getSingleTorqueValue(JointEnum.J2)) < 1.0;
    }

    @Override
    public void run() throws Exception {
        String file = getApplicationData().getProcessData("sample.file").getValue();
        out = new PrintWriter(file, "UTF-8");
        say("process data as text", file.equals(String.valueOf(getApplicationData().getProcessData("sample.file").getValue())));
        say("a robot by its name", lbr != null && NAMED.length == 11);
        lbr.move(ptp(0, 0.5, 0, -1.3, 0, 0.9, 0));
        frames();
        modes();
        motions();
        conditions();
        sensors();
        getContext().dumpDevices();
        PositionMastering mastering = new PositionMastering(lbr);
        MasteringInfo info = mastering.getMasteringInfo("gripper");
        say("mastering of a tool", info.getMasteringState(0));
        Mocked mocked = new Mocked(lbr.getController());
        mocked.light(true);
        say("a mocked output", mocked.getBooleanIOValue("Lamp", true));
        out.close();
    }

    private void frames() {
        Frame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Map<?, IRedundancyCollection> found = here.getRedundancyInformation();
        IRedundancyCollection redundancy = found.get(lbr.getName()).copy();
        IParameterSet all = redundancy.getAllParameters();
        StringBuilder kinds = new StringBuilder();
        for (IParameter<?> one : all) {
            kinds.append(one.value().getClass().getSimpleName()).append(' ');
        }
        say("redundancy as parameters", "Integer Integer Double ".equals(kinds.toString()) && all.paramCount() == 3 && !all.isEmpty());
        Frame copy = lbr.getFlange().copy();
        say("a copy of an object's frame", copy.isCloseTo(lbr.getFlange(), 0.5, 1e-2));
        say("a copy in another frame", lbr.getFlange().copy(lbr.getRootFrame()).isCloseTo(lbr.getFlange(), 0.5, 1e-2));
        say("from frame to frame", Math.abs(copy.staticTransformationTo(here).getX()) < 0.5);
        Transformation turned = MatrixTransformation.of(Vector.of(1, 2, 3),
                MatrixRotation.of(Transformation.ofRad(0, 0, 0, 0.1, 0, 0).getRotationMatrix()));
        say("a transformation of a matrix", Math.abs(turned.getAlphaRad() - 0.1) < 1e-12);
        say("no additional parameter", lbr.getFlange().getAdditionalParameter("colour") == null);
        XmlApplicationDataSource data = getContext().getEngine(IPersistenceEngine.class).getDefaultDataSource();
        try {
            data.loadAllTemplates();
        } catch (UnsupportedOperationException e) {
            say("what is not simulated throws", e.getMessage().startsWith("heptarm: not modelled: loadAllTemplates"));
        }
        try {
            getContext().getEngine(String.class);
        } catch (UnsupportedOperationException e) {
            say("there is one engine", e.getMessage().contains("java.lang.String"));
        }
        RelativeSPL curve = splRel(Transformation.ofTranslation(0, 0, 50)).setAlphaOffset(0.1).setBetaOffset(0.1).setGammaOffset(0.1);
        try {
            lbr.move(new Spline(curve));
        } catch (UnsupportedOperationException e) {
            say("a relative segment is not simulated", e.getMessage().contains("use spl"));
        }
        SceneGraphObject thing = new SceneGraphObject() {
            @Override
            protected void changeParent(ObjectFrame parent) {
            }
        };
        ITransformationProvider place = new ITransformationProvider() {
            @Override
            public boolean isStatic() {
                return true;
            }

            @Override
            public PoseInformation getPoseInformation() {
                return null;
            }

            @Override
            public ITransformation getTransformation() {
                return Transformation.ofTranslation(0, 0, 7);
            }

            @Override
            public String getUniqueName() {
                return "seven";
            }
        };
        ObjectFrame own = new ObjectFrame("own", lbr.getRootFrame(), thing, place);
        say("a frame of one's own", Math.abs(lbr.getRootFrame().transformationTo(own).getZ() - 7) < 1e-9);
        ITaskUI keys = getApplicationUI();
        keys.createUserKeyBar("few").addUserKey(0, (key, event) -> { }, true).setCriticalText("sure?");
    }

    private void modes() {
        CartesianSineImpedanceControlMode sine = new CartesianSineImpedanceControlMode();
        sine.setRiseTime(1).setHoldTime(2).setFallTime(3);
        say("times of a pattern", sine.getRiseTime() == 1 && sine.getHoldTime() == 2 && sine.getFallTime() == 3);
        CartesianImpedanceControlMode mode = new CartesianImpedanceControlMode();
        try {
            mode.setDampingToDefaultValue().setMaxJointSpeed(1, 1, 1, 1, 1, 1, 1);
        } catch (UnsupportedOperationException e) {
            say("a limit that is not simulated throws", true);
        }
        say("speed of hand guiding", new HandGuidingMotion().setAxisSpeedLimit(0.5) != null);
    }

    private void motions() {
        say("motions of a batch", batch(ptp(0, 0, 0, 0, 0, 0, 0), ptp(0, 0, 0, 0.1, 0, 0, 0)).getMotions().size() == 2);
        lbr.move(new PositionHold(new PositionControlMode(), 0, TimeUnit.SECONDS));
        lbr.move(new PositionHold(new PositionControlMode(), 0, null));
        say("a hold of no length ends at once", true);
    }

    private void conditions() throws Exception {
        final ICondition torque = new JointTorqueCondition(JointEnum.J1, -100, 100);
        ConditionObserver observer = getObserverManager().createConditionObserver(new NotCondition(torque), NotificationType.EdgesOnly,
                (IRisingEdgeListener) (one, time, missed) -> { });
        say("an observer's condition", observer.getCondition() instanceof NotCondition);
        try {
            new Own().and(torque);
        } catch (UnsupportedOperationException e) {
            say("a condition of one's own", true);
        }
        IMotionContainer hold = lbr.moveAsync(new PositionHold(new PositionControlMode(), 15, TimeUnit.SECONDS));
        boolean fired = getObserverManager().waitFor(torque, 5, TimeUnit.SECONDS);
        say("waiting for a condition takes simulated time", !fired && !hold.isFinished());
        hold.cancel();
        hold.await(Long.MAX_VALUE, TimeUnit.DAYS);
        say("and may have no end", hold.isFinished());
        final AtomicReference<PositionInformation> there = new AtomicReference<>();
        Frame up = lbr.getCurrentCartesianPosition(lbr.getFlange());
        up.setZ(up.getZ() + 100);
        lbr.move(lin(up).setCartVelocity(100).triggerWhen(new MotionPathCondition(ReferenceType.START, 50, 0), new ICallbackAction() {
            @Override
            public void onTriggerFired(IFiredTriggerInfo info) {
                there.set(info.getPositionInformation());
            }
        }));
        for (int i = 0; there.get() == null && i < 3000; i++) {
            Thread.sleep(10);
        }
        double left = up.getZ() - there.get().getCurrentCartesianPosition().getZ();
        double ahead = there.get().getCommandedCartesianPosition().getZ() - there.get().getCurrentCartesianPosition().getZ();
        say("where a trigger has fired", left > 20 && left < 80 && Math.abs(ahead) < 20);
    }
}
