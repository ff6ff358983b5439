package heptarm.doubles2;

import java.lang.reflect.Field;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import javax.inject.Inject;

import com.kuka.motion.IMotionContainer;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.motionModel.IMotionErrorHandler;
import com.kuka.sensitivity.LBR;
import com.kuka.servoing.api.common.IServoingCapability;
import com.kuka.task.ITaskLogger;

import heptarm.doubles.runtime.Station;
import heptarm.sunrise1.roboticsAPI.applicationModel.RoboticsAPIApplication;
import heptarm.sunrise1.roboticsAPI.motionModel.ErrorHandlingAction;

/** Runs heptarm's application for 2.x inside an application of 1.x: injects, and takes settings from the project's process data. */
public final class Host extends RoboticsAPIApplication {
    private final Signals signals = new Signals();
    private com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication application;

    @Override
    public void initialize() {
        for (Map.Entry<String, Object> entry : Station.current().processData.entrySet()) {
            System.setProperty(entry.getKey(), String.valueOf(entry.getValue()));
        }
        heptarm.sunrise1.task.ITaskLogger log = getLogger();
        try {
            application = (com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication) Class
                    .forName("heptarm.app2.HeptarmApplication").getDeclaredConstructor().newInstance();
            application.use(new ITaskLogger() {
                @Override
                public void error(String text) {
                    log.error(text);
                }

                @Override
                public void info(String text) {
                    log.info(text);
                }

                @Override
                public void warn(String text) {
                    log.warn(text);
                }
            });
            for (Field field : application.getClass().getDeclaredFields()) {
                if (field.isAnnotationPresent(Inject.class)) {
                    field.setAccessible(true);
                    field.set(application, offer(field.getType()));
                }
            }
            application.initialize();
        } catch (Exception e) {
            throw new IllegalStateException(e);
        }
    }

    private Object offer(Class<?> type) {
        IServoingCapability servoing = Servo::new;
        for (Object offer : new Object[] {new LBR(), signals, servoing, (IApplicationControl) this::register}) {
            if (type.isInstance(offer)) {
                return offer;
            }
        }
        throw new IllegalArgumentException("nothing to inject into a " + type.getName());
    }

    private void register(IMotionErrorHandler handler) {
        getApplicationControl().registerMoveAsyncErrorHandler((device, failed, cancelled) -> {
            List<IMotionContainer> others = new ArrayList<>();
            cancelled.forEach(container -> others.add(Container.of(container)));
            handler.handleExecutionError(Container.of(failed), others);
            return ErrorHandlingAction.Ignore;
        });
    }

    @Override
    public void run() throws Exception {
        application.run();
    }

    @Override
    public void dispose() {
        try {
            if (application != null) {
                application.dispose();
            }
        } catch (Exception e) {
            throw new IllegalStateException(e);
        }
    }
}
