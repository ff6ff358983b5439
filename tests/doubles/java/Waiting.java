package sample;

import com.kuka.common.ThreadInterruptedException;
import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPIBackgroundTask;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPITask;
import com.kuka.roboticsAPI.applicationModel.tasks.UseRoboticsAPIContext;

/** Waits until it is stopped; started by the application. */
@UseRoboticsAPIContext
public class Waiting extends RoboticsAPIBackgroundTask {
    /** How it has ended. */
    static volatile String end = "";

    @Override
    public void run() {
        RoboticsAPITask self = this;
        try {
            while (true) {
                ThreadUtil.milliSleep(20);
            }
        } catch (ThreadInterruptedException e) {
            end = "interrupted";
            self.getLogger().info("nothing to wait for any more");
        }
    }

    @Override
    public void dispose() {
        end += " and disposed";
        super.dispose();
    }
}
