package station;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.batch;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.util.Date;
import java.util.concurrent.LinkedBlockingQueue;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.generated.ioAccess.StationIOGroup;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.conditionModel.ConditionObserver;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.IRisingEdgeListener;
import com.kuka.roboticsAPI.conditionModel.NotificationType;
import com.kuka.roboticsAPI.deviceModel.LBR;

/** Works off the orders that the line's controller gives by signals: a rising edge of Start takes the number in Order. */
public class Worker extends RoboticsAPIApplication implements IRisingEdgeListener {
    private static final int LAST = 255;

    @Inject
    private LBR lbr;
    @Inject
    private StationIOGroup io;

    private final LinkedBlockingQueue<Integer> orders = new LinkedBlockingQueue<Integer>();
    private ConditionObserver observer;

    @Override
    public void initialize() {
        io.setDone(Long.valueOf(0));
        ICondition start = new BooleanIOCondition(io.getInput("Start"), true);
        observer = getObserverManager().createConditionObserver(start, NotificationType.EdgesOnly, this);
    }

    @Override
    public void onRisingEdge(ConditionObserver conditionObserver, Date time, int missedEvents) {
        orders.offer(io.getOrder().intValue());
    }

    @Override
    public void run() throws InterruptedException {
        lbr.move(ptp(0, 0.4, 0, -1.4, 0, 1.3, 0).setJointVelocityRel(0.5));
        observer.enable();
        getLogger().info("waiting for orders");
        while (true) {
            Integer order = orders.poll(60, TimeUnit.SECONDS);
            if (order == null) {
                getLogger().warn("no order within a minute");
                continue;
            }
            if (order.intValue() == LAST) {
                break;
            }
            turn(order);
            io.setDone(io.getDone() + 1);
            getLogger().info("order " + order + " is done");
        }
        observer.disable();
        getLogger().info(io.getDone() + " orders are done");
    }

    private void turn(int degrees) {
        double a7 = Math.toRadians(degrees);
        lbr.move(batch(ptp(0, 0.4, 0, -1.4, 0, 1.3, a7), ptp(0, 0.4, 0, -1.4, 0, 1.3, 0)).setJointVelocityRel(0.6));
    }
}
