package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptpHome;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.spl;

import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.io.PrintWriter;
import java.util.ArrayList;
import java.util.Collections;
import java.util.Date;
import java.util.List;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.common.StatisticTimer;
import com.kuka.common.StatisticTimer.OneTimeStep;
import com.kuka.common.ThreadUtil;
import com.kuka.common.concurrent.IWaitToken;
import com.kuka.connectivity.motionModel.smartServo.ServoMotionJP;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.connectivity.userInterface.smartServo.ServoMotionUtilities;
import com.kuka.generated.flexfellow.FlexFellow;
import com.kuka.generated.ioAccess.MediaFlangeIOGroup;
import com.kuka.grippertoolbox.api.gripper.AbstractGripper;
import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.annotations.IAutomaticResumeFunction;
import com.kuka.roboticsAPI.annotations.ResumeAfterPauseEvent;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.commandModel.ICommandRuntimeData;
import com.kuka.roboticsAPI.commandModel.IControllerCommand;
import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.conditionModel.ConditionObserver;
import com.kuka.roboticsAPI.conditionModel.IFallingEdgeListener;
import com.kuka.roboticsAPI.conditionModel.IORangeCondition;
import com.kuka.roboticsAPI.conditionModel.ITriggerAction;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.NotificationType;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.DispatchedEventData;
import com.kuka.roboticsAPI.controllerModel.IControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.IExecutionService;
import com.kuka.roboticsAPI.controllerModel.IRequestService;
import com.kuka.roboticsAPI.controllerModel.StatePortData;
import com.kuka.roboticsAPI.controllerModel.recovery.IRecovery;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseControllerStateListener;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseRequestService;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseLBR;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseSafetyState.OperatorSafety;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSR;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSRFactory;
import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.BrakeState;
import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.BrakeTestResult;
import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.LogLevel;
import com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib.Message;
import com.kuka.roboticsAPI.controllerModel.sunrise.positionMastering.PositionMastering;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.JointLimits;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.deviceModel.Robot;
import com.kuka.roboticsAPI.deviceModel.StatusTurnRedundancy;
import com.kuka.roboticsAPI.executionModel.ICommandContainer;
import com.kuka.roboticsAPI.executionModel.IFiredConditionInfo;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.SpatialObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.MatrixBuilder;
import com.kuka.roboticsAPI.geometricModel.math.MatrixRotation;
import com.kuka.roboticsAPI.geometricModel.math.Rotation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;
import com.kuka.roboticsAPI.geometricModel.math.XyzAbcTransformation;
import com.kuka.roboticsAPI.geometricModel.redundancy.AbstractRedundancyCollection;
import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;
import com.kuka.roboticsAPI.ioModel.AbstractIO;
import com.kuka.roboticsAPI.ioModel.Input;
import com.kuka.roboticsAPI.ioModel.Output;
import com.kuka.roboticsAPI.ioModel.OutputReservedException;
import com.kuka.roboticsAPI.motionModel.BrakeTest;
import com.kuka.roboticsAPI.motionModel.CartesianPTP;
import com.kuka.roboticsAPI.motionModel.HRCMotions;
import com.kuka.roboticsAPI.motionModel.HandGuidingMotion;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionOverlay;
import com.kuka.roboticsAPI.motionModel.MMCMotions;
import com.kuka.roboticsAPI.motionModel.Motion;
import com.kuka.roboticsAPI.motionModel.PTP;
import com.kuka.roboticsAPI.motionModel.PTPHome;
import com.kuka.roboticsAPI.motionModel.RelativeLIN;
import com.kuka.roboticsAPI.motionModel.RobotMotion;
import com.kuka.roboticsAPI.motionModel.SPL;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;
import com.kuka.roboticsAPI.motionModel.SplineMotionJP;
import com.kuka.roboticsAPI.motionModel.controlModeModel.AbstractMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode.CartSineImpBuilder;
import com.kuka.roboticsAPI.motionModel.controlModeModel.HandGuidingControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.roboticsAPI.requestModel.GetApplicationOverrideRequest;
import com.kuka.roboticsAPI.sensorModel.DataRecorder;
import com.kuka.roboticsAPI.sensorModel.DataRecorder.AngleUnit;
import com.kuka.roboticsAPI.sensorModel.StartRecordingAction;
import com.kuka.roboticsAPI.sensorModel.TorqueEvaluator;
import com.kuka.roboticsAPI.sensorModel.TorqueSensorData;
import com.kuka.roboticsAPI.sensorModel.TorqueStatistic;
import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.task.ITask;
import com.kuka.task.ITaskFunctionMonitor;
import com.kuka.task.ITaskInstance;
import com.kuka.task.ITaskLogger;
import com.kuka.task.ITaskManager;
import com.kuka.task.TaskFunctionMonitor;

/** What of Sunrise the other samples leave out, each with a line that the test reads. */
@ResumeAfterPauseEvent(delay = 20, afterRepositioning = true)
public class Touring extends RoboticsAPIApplication implements ISunriseControllerStateListener, IUserKeyListener {
    private static final JointPosition BENT = new JointPosition(0.1, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0);

    @Inject
    private SunriseLBR robot;
    @Inject
    private RoboticsAPIContext context;
    @Inject
    private IApplicationData data;
    @Inject
    private IApplicationUI pad;
    @Inject
    private ITaskLogger log;
    @Inject
    private ITaskManager tasks;
    @Inject
    private MediaFlangeIOGroup flange;
    @Inject
    @Named("sample.file")
    private IProcessData file;
    private LBR lbr;
    private ICounter counter;

    private final List<String> heard = Collections.synchronizedList(new ArrayList<String>());
    private PrintWriter out;

    @Inject
    private void equip(@Named("Gripper") Tool tool) {
        heard.add("equipped with " + tool.getName());
    }

    @Override
    public void initialize() {
        lbr = robot;
        try {
            out = new PrintWriter(file.<String>getValue(), "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
        counter = getTaskFunction(ICounter.class);
        getTaskFunction(IAutomaticResumeFunction.class).enableApplicationResuming(getClass().getCanonicalName());
        lbr.getController().addControllerListener(this);
    }

    @Override
    public void run() throws Exception {
        injected();
        geometry();
        objects();
        device();
        motions();
        together();
        brakes();
        recording();
        signals();
        tasks();
        stops();
    }

    private void injected() {
        Robot old = getRobot(null, "LBR");
        Tool tool = createFromTemplate("Gripper");
        say("a marked method was called", heard.remove("equipped with Gripper"));
        say("one context, one robot", getContext() == context && context.getDeviceFromType(LBR.class) == lbr && old == lbr
                && context.getDefaultController() == context.getControllers().toArray()[0]);
        say("the project's own class of tools", tool instanceof Pen && tool.getLoadData().getMass() == 0.5);
        ObjectFrame taught = data.getFrame("/Table/Corner");
        IRedundancyCollection arm = taught.getRedundancyInformationForDevice(lbr);
        say("a taught frame knows its arm", ((LBRE1Redundancy) arm).getE1() == 0.25 && ((StatusTurnRedundancy) arm).getStatus() == 2
                && getFrame("/Table") == taught.getParent());
        IRecovery recovery = getRecovery();
        say("nothing to recover from", !recovery.isRecoveryRequired());
        try {
            runApplication();
            say("the cabinet runs applications", false);
        } catch (IllegalStateException e) {
            say("the cabinet runs applications", true);
        }
    }

    private void geometry() {
        MatrixBuilder builder = new MatrixBuilder();
        builder.setElement01(-1).setElement10(1).setElement22(1);
        Matrix turn = builder.toMatrix();
        ITransformation step = Transformation.of(Vector.of(100, 0, 0), MatrixRotation.of(turn));
        say("a matrix turns", Math.abs(step.getAlphaRad() - Math.PI / 2) < 1e-12 && turn.getRow(1).getX() == turn.get(1, 0));
        AbstractFrame corner = new Frame(200, 0, 0);
        Frame point = new Frame(corner, step);
        point.transform(Transformation.ofTranslation(10, 0, 0));
        say("a step in its own axes", new Frame(300, 10, 0).distanceTo(point) < 1e-9);
        point.transform(World.Current.getRootFrame(), XyzAbcTransformation.ofTranslation(10, 0, 0));
        say("a step in the world's axes", new Frame(310, 10, 0).distanceTo(point) < 1e-9);
        Transformation turned = Transformation.ofTranslation(1, 2, 3).withRotation(Rotation.ofRad(0, 0, 1)).withTranslation(Vector.of(4, 5, 6));
        say("parts of a transformation", turned.getX() == 4 && Math.abs(turned.getGammaRad() - 1) < 1e-12
                && XyzAbcTransformation.ofRad(0, 0, 0, 4, 0, 0).getAlphaRad() == 4);
        say("near is a matter of degree", point.isCloseTo(new Frame(311, 10, 0, 1.5, 0, 0), 2, 0.1)
                && !point.isCloseTo(new Frame(311, 10, 0), 2, 0.1) && !point.isCloseTo(corner, 2, 3));
        say("one tree", point.hasPathTo(lbr.getFlange()) && point.toStringInWorld().contains("310.00"));
    }

    private void objects() {
        PhysicalObject tool = ServoMotionUtilities.createTool(lbr, "tester", new double[] {0, 0, 100}, 0.4, new double[] {0, 0, 50});
        Workpiece piece = new Workpiece("piece");
        ObjectFrame grip = piece.addChildFrame("grip", Transformation.ofTranslation(0, 0, 30));
        grip.attachTo(tool.getDefaultMotionFrame());
        SpatialObject held = piece;
        say("gripped where it is meant to be", grip.distanceTo(tool.getDefaultMotionFrame()) < 1e-9
                && Math.abs(lbr.getFlange().transformationTo(held.getRootFrame()).getZ() - 70) < 1e-9);
        lbr.changeFramePosition(grip, Transformation.ofTranslation(0, 0, 40));
        say("a frame is moved", grip.getZ() == 40.0);
        say("the robot of a context", ServoMotionUtilities.locateLBR(context) == lbr);
        ServoMotionUtilities.resetControllerAndKILLALLMOTIONS(lbr);
        tool.detach();
    }

    private void device() {
        JointLimits limits = lbr.getJointLimits();
        say("limits", limits.getMaxJointPosition().get(JointEnum.J4) > 2.0 && limits.getMinJointPosition().get(3) < -2.0);
        ISafetyState safety = lbr.getSafetyState();
        say("a closed safeguard", safety.getOperatorSafetyState() == OperatorSafety.OPERATOR_SAFETY_CLOSED && lbr.isMotionEnabled());
        say("mastered and referenced", new PositionMastering(lbr).isAxisMastered(6) && safety.areAllAxesGMSReferenced());
        IRequestService requests = lbr.getController().getRequestService();
        SSR request = SSRFactory.createSafetyCommandSSR(2);
        Message answer = ((ISunriseRequestService) requests).sendSynchronousSSR(request);
        say("a measurement of torque referencing", answer.getParamInt(0) == 1);
        lbr.setESMState("1");
        TorqueSensorData torques = lbr.getMeasuredTorque();
        int refused = 0;
        try {
            lbr.setESMState("11");
        } catch (IllegalArgumentException e) {
            refused++;
        }
        try {
            torques.getSingleTorqueValue(JointEnum.J8);
        } catch (IllegalArgumentException e) {
            refused++;
        }
        try {
            new JointTorqueCondition(JointEnum.J9, -1, 1);
        } catch (IllegalArgumentException e) {
            refused++;
        }
        say("what there is not is refused", refused == 3);
        Frame wanted = new Frame(450, 100, 500, Math.PI, 0, Math.PI);
        AbstractRedundancyCollection arm = new LBRE1Redundancy(0.3, 2, 0);
        wanted.setRedundancyInformation(lbr, arm);
        JointPosition found = lbr.getInverseKinematicFromFrameAndRedundancy(wanted);
        lbr.move(ptp(found));
        Frame reached = lbr.getCurrentCartesianPosition(lbr.getFlange());
        LBRE1Redundancy own = (LBRE1Redundancy) reached.getRedundancyInformationForDevice(lbr);
        say("inverse kinematics with redundancy", reached.isCloseTo(wanted, 0.5, 1e-3) && Math.abs(own.getE1() - 0.3) < 1e-2
                && own.getStatus() == 2);
        try {
            lbr.getInverseKinematicFromFrameAndRedundancy(new Frame(3000, 0, 0));
            say("out of reach", false);
        } catch (IllegalArgumentException e) {
            say("out of reach", true);
        }
    }

    private void motions() {
        lbr.setHomePosition(BENT);
        PTPHome home = ptpHome();
        SplineMotionJP<?> jointly = home.setJointVelocityRel(0.8);
        lbr.move(jointly);
        say("home", lbr.getCurrentJointPosition().isNearlyEqual(BENT, 1e-3));
        Frame here = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Frame there = here.copyWithRedundancy();
        there.setZ(there.getZ() - 60);
        CartesianPTP over = ptp(there);
        RelativeLIN back = linRel(new Frame(0, 0, 60).getTransformationFromParent(), World.Current.getRootFrame());
        Motion<?> first = over.setJointVelocityRel(0.5);
        RobotMotion<?> second = back.setCartVelocity(200);
        say("parameters can be printed", second.getParams().toString().contains("200.0"));
        lbr.move(first);
        lbr.move(second);
        say("there and back", lbr.getCurrentCartesianPosition(lbr.getFlange()).distanceTo(here) < 0.5);
        SPL one = spl(there);
        SplineMotionCP<?>[] curve = {one, spl(here)};
        IMotionOverlay none = null;
        IMotionControlMode compliant = new JointImpedanceControlMode(2000, 2000, 2000, 2000, 2000, 2000, 2000);
        AbstractMotionControlMode stiff = new PositionControlMode(true);
        lbr.move(new Spline(curve).setCartVelocity(200).setMode(compliant));
        CartesianSineImpedanceControlMode shake = new CartesianSineImpedanceControlMode();
        CartSineImpBuilder direction = shake.parametrize(CartDOF.X);
        direction.setAmplitude(5).setFrequency(4).setStiffness(2000);
        lbr.move(positionHold(shake.setTotalTime(0.3).setStayActiveUntilPatternFinished(false), 200, TimeUnit.MILLISECONDS));
        ServoMotionJP<?> servo = new SmartServo(lbr.getCurrentJointPosition());
        say("modes and servo motions", none == null && stiff.toString().length() > 0 && servo.getMode() == null
                && Math.abs(lbr.getCurrentCartesianPosition(lbr.getFlange()).distanceTo(here)) < 20);
        try {
            lbr.move(positionHold(new HandGuidingControlMode(), 1, TimeUnit.SECONDS));
            say("hand guiding is no mode of a hold", false);
        } catch (IllegalArgumentException e) {
            say("hand guiding is no mode of a hold", true);
        }
        HandGuidingMotion guided = MMCMotions.handGuiding();
        say("its older name", guided.getClass() == HRCMotions.handGuiding().getClass());
        lbr.move(lin(here).setCartVelocity(200));
    }

    private void together() {
        IMotion lift = linRel(0, 0, -20).setCartVelocity(100);
        PTP bent = new PTP(BENT).setJointVelocityRel(0.5);
        IMotionContainer container = lbr.moveAsync(lift);
        container.append(bent);
        say("an appended motion is awaited", !container.isFinished());
        container.await();
        container.validate();
        say("and was the last", container.getLastExecutedMotion() == bent && lbr.getCurrentJointPosition().isNearlyEqual(BENT, 1e-3));
        ICommandContainer command = container;
        IControllerCommand text = command.getCommand();
        ICommandRuntimeData runtime = command.getRuntimeData();
        say("both can be printed", text.toString().length() > 0 && runtime.toString().contains("Finished"));
        IMotionContainer long1 = lbr.moveAsync(linRel(0, 0, -100).setCartVelocity(20));
        long1.append(new PTP(BENT));
        ThreadUtil.milliSleep(400);
        long1.cancel();
        long1.await();
        lbr.move(positionHold(null, 100, TimeUnit.MILLISECONDS));
        say("cancelling takes the appended ones along", !long1.hasError()
                && !lbr.getCurrentJointPosition().isNearlyEqual(BENT, 1e-3));
        JointTorqueCondition always = new JointTorqueCondition(lbr, JointEnum.J1, -1000, 1000);
        IMotionContainer ended = lbr.move(positionHold(null, 5, TimeUnit.SECONDS).breakWhen(always.invert()));
        IFiredConditionInfo info = ended.getFiredBreakConditionInfo();
        say("a condition that holds already ends a motion", info != null && ended.hasFired(info.getFiredCondition()));
        SunriseExecutionService execution = (SunriseExecutionService) lbr.getController().getExecutionService();
        IExecutionService plain = execution;
        execution.blockExecutionForBrakeTest();
        ThreadUtil.milliSleep(20);
        boolean blocked = execution.isPaused();
        execution.unblockExecutionForBrakeTest();
        plain.cancelAll();
        say("blocked for a brake test", blocked && execution.getActiveContainerCount() == 0);
    }

    private void brakes() {
        TorqueEvaluator evaluator = new TorqueEvaluator(lbr);
        evaluator.setTorqueMeasured(false);
        evaluator.startEvaluation();
        lbr.move(ptp(0.3, 0.6, 0.1, -1.0, 0.1, 0.7, 0.2).setJointVelocityRel(0.7));
        TorqueStatistic statistic = evaluator.stopEvaluation();
        double[] most = statistic.getMaxAbsTorqueValues();
        say("the shoulder carries most", most[1] > most[3] && most[3] > most[6] && most[1] > 20);
        BrakeTestResult good = BrakeTest.evaluateResult(lbr.move(new BrakeTest(1, most[1])));
        BrakeTestResult bad = BrakeTest.evaluateResult(lbr.move(new BrakeTest(6, 1000)));
        LogLevel level = good.getState().getLogLevel();
        BrakeState state = bad.getState();
        say("a brake holds what the axis needs, but not anything", level == LogLevel.Info && state.getLogLevel() == LogLevel.Error);
    }

    private void recording() throws Exception {
        DataRecorder recorder = new DataRecorder("touring.log", -1, TimeUnit.SECONDS, 5);
        recorder.addCurrentJointPosition(lbr, AngleUnit.Degree).addCommandedJointPosition(lbr, AngleUnit.Radian);
        recorder.addInternalJointTorque(lbr).addExternalJointTorque(lbr).addCartesianForce(lbr.getFlange(), null)
                .addCartesianTorque(lbr.getFlange(), World.Current.getRootFrame())
                .addCurrentCartesianPositionXYZ(lbr.getFlange(), World.Current.getRootFrame())
                .addCommandedCartesianPositionXYZ(lbr.getFlange(), World.Current.getRootFrame());
        recorder.enable();
        ITriggerAction start = new StartRecordingAction(recorder);
        lbr.move(linRel(0, 0, -80).setCartVelocity(40).triggerWhen(new MotionPathCondition(ReferenceType.START, 20, 0), start));
        ThreadUtil.milliSleep(300);
        recorder.stopRecording();
        say("a recording is there", recorder.isFileAvailable() && recorder.awaitFileAvailable(1, TimeUnit.SECONDS)
                && recorder.getFileName().equals("touring.log"));
        BufferedReader in = new BufferedReader(new InputStreamReader(recorder.getURL().openStream(), "UTF-8"));
        String[] names = in.readLine().split(" ");
        List<String[]> rows = new ArrayList<String[]>();
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            rows.add(line.split(" "));
        }
        in.close();
        String[] begin = rows.get(0);
        String[] end = rows.get(rows.size() - 1);
        say("of every number", names.length == 1 + 4 * 7 + 4 * 3 && begin.length == names.length);
        double travel = 0.0;
        for (int i = names.length - 6; i < names.length - 3; i++) {
            double step = Double.parseDouble(end[i]) - Double.parseDouble(begin[i]);
            travel += step * step;
        }
        say("from the trigger on", Math.sqrt(travel) > 0.5 && Math.sqrt(travel) < 61);
        double tenth = Double.parseDouble(rows.get(10)[0]); // a busy machine is late
        say("every five milliseconds", tenth > 0.05 - 1e-9 && tenth < 0.3);
    }

    private void signals() {
        AbstractIO led = flange.getIO("LEDBlue", true);
        Output output = (Output) led;
        Input button = (Input) flange.getInput("UserButton");
        final StringBuilder fell = new StringBuilder();
        ConditionObserver observer = getObserverManager().createConditionObserver(new BooleanIOCondition(output, true),
                NotificationType.EdgesOnly, new IFallingEdgeListener() {
                    @Override
                    public void onFallingEdge(ConditionObserver one, Date time, int missed) {
                        fell.append("off");
                    }
                });
        observer.enable();
        try {
            flange.setLEDBlue(true);
            ThreadUtil.milliSleep(20);
            say("the lamp of the flange", flange.getLEDBlue() && !flange.getUserButton() && button != null);
            say("in a range", getObserverManager().waitFor(new IORangeCondition(output, 0.5, 1.5), 5, TimeUnit.SECONDS));
            flange.setLEDBlue(false);
        } catch (OutputReservedException e) {
            say("the lamp of the flange", e);
        }
        boolean off = getObserverManager().waitFor(new IORangeCondition(output, 0.5, 1.5).invert(), 5, TimeUnit.SECONDS);
        for (int i = 0; i < 500 && fell.length() == 0; i++) {
            ThreadUtil.milliSleep(10);
        }
        say("a falling edge", off && fell.toString().equals("off"));
    }

    private void tasks() throws Exception {
        ITaskFunctionMonitor monitor = TaskFunctionMonitor.create(counter);
        StatisticTimer timer = new StatisticTimer();
        OneTimeStep step = timer.newTimeStep();
        int before = counter.count();
        while (counter.count() < before + 5) {
            ThreadUtil.milliSleep(10);
        }
        step.end();
        say("a background task counts beside us", monitor.isAvailable() && timer.getMeanTimeMillis() > 0);
        counter.reset();
        ITask task = tasks.getTask(Waiting.class);
        ITaskInstance instance = task.startInstance();
        boolean ran = task.getInstances().contains(instance);
        task.stopAllInstances();
        say("another is started and stopped", ran && task.getInstances().isEmpty() && Waiting.end.equals("interrupted and disposed"));
        tasks.getTask(Counting.class).stopAllInstances();
        say("its function goes with it", !monitor.isAvailable());
        try {
            counter.count();
            say("and calls fail", false);
        } catch (IllegalStateException e) {
            say("and calls fail", true);
        }
    }

    /** The test requests a protective stop while the arm moves, ends it, then answers the dialog. */
    private void stops() {
        heard.clear();
        IMotionContainer container = lbr.moveAsync(positionHold(null, 3, TimeUnit.SECONDS));
        say("STOP ME", true);
        for (int i = 0; i < 2000 && heard.size() < 4; i++) {
            ThreadUtil.milliSleep(10);
        }
        container.await();
        say("the stop and its end were reported", heard.contains("ready false") && heard.contains("ready true")
                && heard.contains("safety STOP1") && heard.contains("safety NOSTOP"));
        say("and the motion went on by itself", !container.hasError());
        IUserKeyBar bar = pad.createUserKeyBar("tour");
        IUserKey key = bar.addDoubleUserKey(2, this, true);
        key.setText(UserKeyAlignment.TopMiddle, "on");
        key.setText(UserKeyAlignment.BottomMiddle, "off");
        bar.publish();
        say("PRESS ME", true);
        for (int i = 0; i < 2000 && !heard.contains("SecondKeyUp"); i++) {
            ThreadUtil.milliSleep(10);
        }
        say("the second half of a double key", heard.contains("SecondKeyDown") && !heard.contains("FirstKeyDown"));
        say("ASK ME", true);
        int answer = pad.displayModalDialog(ApplicationDialogType.QUESTION, "Has it been a good tour?", "no", "yes");
        say("a dialog", answer == 1);
        log.info("toured");
    }

    @Override
    public void onKeyEvent(IUserKey key, UserKeyEvent event) {
        heard.add(event.toString());
    }

    // ------------------------------------------------------------------------------ the controller's listener
    @Override
    public void onSafetyStateChanged(Device device, SunriseSafetyState state) {
        heard.add("safety " + state.getSafetyStopSignal());
    }

    @Override
    public void onIsReadyToMoveChanged(Device device, boolean ready) {
        heard.add("ready " + ready);
    }

    @Override
    public void statePortChanged(Controller controller, StatePortData state) {
        heard.add("a state port");
    }

    @Override
    public void onFieldBusDeviceConfigurationChangeReceived(String controller, DispatchedEventData event) {
        heard.add("a field bus");
    }

    @Override
    public void onFieldBusDeviceIdentificationRequestReceived(String controller, DispatchedEventData event) {
        heard.add("a device of a field bus");
    }

    @Override
    public void onShutdown(Controller controller) {
        heard.add("shut down");
    }

    @Override
    public void onConnectionLost(Controller controller) {
        heard.add("lost");
    }

    @Override
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
        super.onApplicationStateChanged(state);
        log.info("now " + state);
    }

    @Override
    public void dispose() {
        IControllerStateListener listener = this;
        say("disposed", listener == this);
        super.dispose();
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
