package heptarm.doubles.runtime;

import java.util.ArrayList;
import java.util.List;
import java.util.function.Consumer;
import java.util.logging.Level;
import java.util.logging.Logger;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.task.ITaskLogger;

import heptarm.doubles.pad.SmartPad;

/** Application data, application control, observers and logger that the cabinet provides to one task. */
public final class ApplicationServices implements IApplicationData, IApplicationControl {
    /** Services of the application; background tasks have their own. */
    private static volatile ApplicationServices application;
    private static final InheritableThreadLocal<ApplicationServices> OWN = new InheritableThreadLocal<>();

    public final ITaskLogger logger = new JulLogger();
    public final SmartPad pad;
    public final ObserverManager observers = new ObserverManager();
    private final Station station;
    private final Consumer<String> terminate;
    private volatile IErrorHandler errorHandler;
    private volatile double override = 1.0;

    ApplicationServices(Station station, Consumer<String> terminate) {
        this.station = station;
        this.terminate = terminate;
        this.pad = station.pad;
    }

    public static ApplicationServices ofApplication() {
        return application;
    }

    /** Makes these the services of the application, which receive the errors of asynchronous motions. */
    void becomeApplication() {
        application = this;
    }

    /** Binds the calling thread, and threads that it starts, to these services; returns the previous ones. */
    ApplicationServices enter() {
        ApplicationServices previous = OWN.get();
        OWN.set(this);
        return previous;
    }

    static void leave(ApplicationServices previous) {
        OWN.set(previous);
    }

    /** Services of the task that owns the calling thread; for threads of the cabinet those of the application. */
    public static ApplicationServices current() {
        ApplicationServices own = OWN.get();
        return own == null ? application : own;
    }

    /** An asynchronous motion of the application has failed; called on the dispatch thread. */
    public void failed(IMotionContainer container, List<IMotionContainer> cancelled) {
        IErrorHandler handler = errorHandler;
        if (handler == null) {
            String why = "an asynchronous motion failed and no error handler is registered; the application ends: "
                    + container.getErrorMessage();
            logger.error(why);
            terminate.accept(why);
            return;
        }
        ErrorHandlingAction action = handler.handleError(station.robot, container, new ArrayList<>(cancelled));
        if (action == ErrorHandlingAction.EndApplication) {
            terminate.accept("the application's error handler ended it after a motion failed: " + container.getErrorMessage());
        } else if (action == ErrorHandlingAction.PauseMotion) {
            station.plant.pause();
        }
    }

    @Override
    public void registerMoveAsyncErrorHandler(IErrorHandler handler) {
        errorHandler = handler;
    }

    @Override
    public double getApplicationOverride() {
        return override;
    }

    @Override
    public void setApplicationOverride(double value) {
        if (!(value >= 0.0 && value <= 1.0)) {
            throw new IllegalArgumentException("application override must be in [0, 1], got " + value);
        }
        override = value;
        station.sharedState.setOverride(value);
    }

    @Override
    public void clipApplicationOverride(double limit) {
        setApplicationOverride(Math.min(override, limit));
    }

    @Override
    public void clipManualOverride(double limit) {
        if (!(limit >= 0.0 && limit <= 1.0)) {
            throw new IllegalArgumentException("limit of the manual override must be in [0, 1], got " + limit);
        }
        station.plant.clipManualOverride(limit);
    }

    @Override
    public void pause() {
        station.plant.pause();
    }

    @Override
    public void halt() {
        station.plant.pause();
    }

    @Override
    @SuppressWarnings("unchecked")
    public <T> T createFromTemplate(String name) {
        ObjectTemplate template = station.templates.get(name);
        if (template == null) {
            throw new PersistenceException("no object template " + name + " in the project");
        }
        return (T) template.make(name);
    }

    @Override
    public ObjectFrame getFrame(String path) {
        ObjectFrame found = World.Current.getRootFrame();
        for (String part : path.split("/")) {
            found = part.length() == 0 || found == null ? found : found.getChild(part);
        }
        if (found == null || found == World.Current.getRootFrame()) {
            throw new PersistenceException("no frame " + path + " in the project");
        }
        return found;
    }

    @Override
    public IProcessData tryGetProcessData(String id) {
        return station.processData.containsKey(id) ? getProcessData(id) : null;
    }

    @Override
    public IProcessData getProcessData(final String id) {
        if (!station.processData.containsKey(id)) {
            String why = station.unusable.get(id);
            throw new PersistenceException(why == null ? "no process data " + id + " in the project"
                    : "the process data " + id + " cannot be used: " + why);
        }
        return new IProcessData() {
            @Override
            @SuppressWarnings("unchecked")
            public <T extends Object & Comparable<?>> T getValue() {
                return (T) station.processData.get(id);
            }

            @Override
            public void setValue(Object value) {
                station.processData.put(id, value);
            }

            @Override
            public void setDefaultValue(Object value) {
                station.processData.putIfAbsent(id, value);
            }
        };
    }

    /** Forwards the task's log to java.util.logging; Python configures its handlers. */
    private static final class JulLogger implements ITaskLogger {
        private static final Logger LOG = Logger.getLogger("heptarm.cabinet");

        @Override
        public void error(String text) {
            LOG.severe(text);
        }

        @Override
        public void error(String text, Throwable cause) {
            LOG.log(Level.SEVERE, text, cause);
        }

        @Override
        public void fine(String text) {
            LOG.fine(text);
        }

        @Override
        public void info(String text) {
            LOG.info(text);
        }

        @Override
        public void warn(String text) {
            LOG.warning(text);
        }

        @Override
        public void warn(String text, Throwable cause) {
            LOG.log(Level.WARNING, text, cause);
        }
    }
}
