package recording;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.circ;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.spl;

import java.io.BufferedReader;
import java.io.BufferedWriter;
import java.io.File;
import java.io.FileReader;
import java.io.FileWriter;
import java.io.IOException;
import java.util.Enumeration;
import java.util.Vector;
import java.util.concurrent.Executors;
import java.util.concurrent.ScheduledExecutorService;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.common.StatisticTimer;
import com.kuka.common.StatisticTimer.OneTimeStep;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.ReferenceType;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;
import com.kuka.roboticsAPI.sensorModel.DataRecorder;
import com.kuka.roboticsAPI.sensorModel.DataRecorder.AngleUnit;
import com.kuka.roboticsAPI.sensorModel.ForceSensorData;
import com.kuka.roboticsAPI.sensorModel.StartRecordingAction;
import com.kuka.roboticsAPI.sensorModel.TorqueEvaluator;

/** Records a path twice: by the controller's recorder, and by a thread that looks every 20 ms and writes a CSV file. */
public class Recorder extends RoboticsAPIApplication {
    private static final String NEWLINE = System.getProperty("line.separator");

    @Inject
    private LBR lbr;

    private final Vector<String> samples = new Vector<String>();
    private final StatisticTimer timer = new StatisticTimer();
    private ScheduledExecutorService sampler;
    private String folder;

    @Override
    public void initialize() {
        folder = getApplicationData().getProcessData("recordings").getValue();
        sampler = Executors.newSingleThreadScheduledExecutor();
    }

    @Override
    public void run() throws IOException {
        lbr.move(ptp(0, Math.toRadians(30), 0, Math.toRadians(-90), 0, Math.toRadians(60), 0).setJointVelocityRel(0.5));

        DataRecorder rec = new DataRecorder();
        rec.setFileName("path.log");
        rec.setSampleRate(5);
        rec.setTimeout(60, TimeUnit.SECONDS);
        rec.addCurrentJointPosition(lbr, AngleUnit.Degree).addExternalJointTorque(lbr);
        rec.addCurrentCartesianPositionXYZ(lbr.getFlange(), lbr.getRootFrame());
        rec.enable();
        TorqueEvaluator evaluator = new TorqueEvaluator(lbr);
        evaluator.setTorqueMeasured(true);
        evaluator.startEvaluation();
        sampler.scheduleAtFixedRate(new Sampling(), 0, 20, TimeUnit.MILLISECONDS);

        path(rec);

        sampler.shutdown();
        rec.stopRecording();
        if (!rec.awaitFileAvailable(10, TimeUnit.SECONDS)) {
            throw new IOException("no recording in " + folder);
        }
        double[] highest = evaluator.stopEvaluation().getMaxAbsTorqueValues();
        File csv = new File(folder, "samples.csv");
        BufferedWriter writer = new BufferedWriter(new FileWriter(csv));
        try {
            writer.write("ms;x;y;z;fx;fy;fz;valid" + NEWLINE);
            for (Enumeration<String> e = samples.elements(); e.hasMoreElements();) {
                writer.write(e.nextElement());
                writer.newLine();
            }
        } finally {
            writer.close();
        }
        getLogger().info(lines(new File(rec.getURL().getPath())) + " lines in " + rec.getFileName() + ", " + samples.size()
                + " in " + csv.getName() + ", a sample takes " + timer.getMeanTimeMillis() + " ms");
        getLogger().info(String.format("highest torque of A2: %.1f Nm, of A4: %.1f Nm", highest[1], highest[3]));
    }

    /** The recording starts on the first line, after 10 mm. */
    private void path(DataRecorder rec) {
        Frame start = lbr.getCurrentCartesianPosition(lbr.getFlange());
        Frame aside = start.copyWithRedundancy();
        aside.setY(start.getY() + 80);
        lbr.move(lin(aside).setCartVelocity(150)
                .triggerWhen(new MotionPathCondition(ReferenceType.START, 10, 0), new StartRecordingAction(rec)));

        Frame top = start.copyWithRedundancy();
        top.setZ(start.getZ() + 80);
        Frame between = start.copyWithRedundancy();
        between.setY(start.getY() + 80 * Math.sqrt(0.5));
        between.setZ(start.getZ() + 80 * Math.sqrt(0.5));
        lbr.move(circ(between, top).setCartVelocity(150));

        Frame low = start.copyWithRedundancy();
        low.setY(start.getY() - 40);
        Spline back = new Spline(spl(between), spl(aside), spl(low), spl(start)).setCartVelocity(150);
        lbr.move(back);

        JointImpedanceControlMode stiff = new JointImpedanceControlMode(2000, 2000, 2000, 2000, 1000, 1000, 1000);
        stiff.setDampingForAllJoints(0.8);
        lbr.move(positionHold(stiff, 300, TimeUnit.MILLISECONDS));
    }

    private static int lines(File file) throws IOException {
        BufferedReader reader = new BufferedReader(new FileReader(file));
        try {
            int count = 0;
            while (reader.readLine() != null) {
                count++;
            }
            return count;
        } finally {
            reader.close();
        }
    }

    @Override
    public void dispose() {
        if (sampler != null) {
            sampler.shutdownNow();
        }
        super.dispose();
    }

    private class Sampling implements Runnable {
        private final long began = System.currentTimeMillis();

        @Override
        public void run() {
            OneTimeStep step = timer.newTimeStep();
            Frame at = lbr.getCurrentCartesianPosition(lbr.getFlange());
            ForceSensorData force = lbr.getExternalForceTorque(lbr.getFlange());
            StringBuilder line = new StringBuilder();
            line.append(System.currentTimeMillis() - began);
            double[] values = {at.getX(), at.getY(), at.getZ(), force.getForce().getX(), force.getForce().getY(),
                    force.getForce().getZ()};
            for (int i = 0; i < values.length; i++) {
                line.append(';').append(Math.round(100 * values[i]) / 100.0);
            }
            samples.add(line.append(';').append(force.isForceValid(10)).toString());
            step.end();
        }
    }
}
