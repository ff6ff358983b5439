package menu;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptpHome;

import java.text.SimpleDateFormat;
import java.util.ArrayList;
import java.util.Date;
import java.util.HashMap;
import java.util.Map;

import javax.inject.Inject;

import com.kuka.common.ThreadUtil;
import com.kuka.generated.ioAccess.MediaFlangeIOGroup;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianImpedanceControlMode;
import com.kuka.roboticsAPI.motionModel.controlModeModel.CartesianSineImpedanceControlMode;
import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLED;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLEDSize;

/** A menu on the smartPAD: jobs by dialog; user keys switch the lamp of the flange and choose the speed. */
public class PadMenu extends RoboticsAPIApplication {
    private enum Job { HOME, NOD, SEARCH, COUNT, END }

    @Inject
    private LBR lbr;
    @Inject
    private MediaFlangeIOGroup flange;

    private final Map<Job, Integer> done = new HashMap<Job, Integer>();
    private volatile double speed = 0.25;
    private volatile boolean lamp = false;
    private IUserKeyBar keyBar;

    @Override
    public void initialize() {
        lbr.setHomePosition(new JointPosition(0, 0.4, 0, -1.4, 0, 1.3, 0));
        keyBar = getApplicationUI().createUserKeyBar("MENU");
        IUserKey light = keyBar.addUserKey(0, new IUserKeyListener() {
            @Override
            public void onKeyEvent(IUserKey key, UserKeyEvent event) {
                if (event == UserKeyEvent.KeyDown) {
                    lamp = !lamp;
                    flange.setLEDBlue(lamp);
                    key.setLED(UserKeyAlignment.BottomMiddle, lamp ? UserKeyLED.Green : UserKeyLED.Grey, UserKeyLEDSize.Small);
                    getLogger().info("lamp " + (lamp ? "on" : "off"));
                }
            }
        }, true);
        light.setText(UserKeyAlignment.TopMiddle, "LAMP");
        light.setLED(UserKeyAlignment.BottomMiddle, UserKeyLED.Grey, UserKeyLEDSize.Small);

        IUserKey faster = keyBar.addDoubleUserKey(1, new IUserKeyListener() {
            @Override
            public void onKeyEvent(IUserKey key, UserKeyEvent event) {
                switch (event) {
                    case FirstKeyDown:
                        speed = Math.min(1.0, speed + 0.25);
                        break;
                    case SecondKeyDown:
                        speed = Math.max(0.25, speed - 0.25);
                        break;
                    default:
                        return;
                }
                getLogger().info(String.format("speed %.0f %%", 100 * speed));
            }
        }, true);
        faster.setText(UserKeyAlignment.TopMiddle, "+");
        faster.setText(UserKeyAlignment.BottomMiddle, "-");
        keyBar.publish();
    }

    @Override
    public void run() {
        Job job;
        do {
            int button = getApplicationUI().displayModalDialog(ApplicationDialogType.QUESTION, "Next job?", names());
            job = Job.values()[button];
            count(job);
            switch (job) {
                case HOME:
                    lbr.move(ptpHome().setJointVelocityRel(speed));
                    break;
                case NOD:
                    nod();
                    break;
                case SEARCH:
                    search();
                    break;
                case COUNT:
                    tell();
                    break;
                default:
                    break;
            }
        } while (job != Job.END);
        getLogger().info("jobs done: " + done.get(Job.HOME) + " " + done.get(Job.NOD) + " " + done.get(Job.SEARCH));
    }

    private static String[] names() {
        ArrayList<String> names = new ArrayList<String>();
        for (Job job : Job.values()) {
            names.add(job.name().charAt(0) + job.name().substring(1).toLowerCase());
        }
        return names.toArray(new String[names.size()]);
    }

    private void count(Job job) {
        Integer before = done.get(job);
        done.put(job, before == null ? 1 : before + 1);
    }

    private void nod() {
        double[] here = lbr.getCurrentJointPosition().get();
        for (int i = 0; i < 2; i++) {
            double[] there = here.clone();
            there[5] += Math.toRadians(i % 2 == 0 ? 12 : -12);
            lbr.moveAsync(ptp(there).setJointVelocityRel(speed).setBlendingRel(0.2));
        }
        lbr.move(ptp(here).setJointVelocityRel(speed));
    }

    /** Wiggles while it presses down, as when a peg is put into a hole. */
    private void search() {
        int answer = getApplicationUI().displayModalDialog(ApplicationDialogType.WARNING,
                "The arm presses down with 5 N.\r\nIs the place below it free?", "Go on", "Cancel");
        if (answer == 1) {
            getLogger().warn("search cancelled");
            return;
        }
        CartesianSineImpedanceControlMode wiggle = CartesianSineImpedanceControlMode.createSinePattern(CartDOF.X, 2.0, 5.0, 1500.0);
        wiggle.parametrize(CartDOF.Z).setStiffness(800).setBias(5.0);
        wiggle.setRiseTime(0.2);
        wiggle.setFallTime(0.2);
        lbr.move(linRel(0, 0, 10).setCartVelocity(10).setMode(wiggle));
        CartesianImpedanceControlMode compliant = new CartesianImpedanceControlMode();
        compliant.parametrize(CartDOF.TRANSL).setStiffness(600.0);
        compliant.parametrize(CartDOF.ROT).setStiffness(100.0);
        compliant.setNullSpaceStiffness(50.0);
        lbr.move(linRel(0, 0, -10).setCartVelocity(20).setMode(compliant));
    }

    private void tell() {
        String at = new SimpleDateFormat("HH:mm:ss").format(new Date());
        getApplicationUI().displayModalDialog(ApplicationDialogType.INFORMATION, at + " nods: " + done.get(Job.NOD), "OK");
        ThreadUtil.milliSleep(100);
    }
}
