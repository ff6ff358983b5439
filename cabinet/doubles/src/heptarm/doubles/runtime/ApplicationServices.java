package heptarm.doubles;

import java.util.ArrayList;
import java.util.List;
import java.util.logging.Level;
import java.util.logging.Logger;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.conditionModel.ObserverManager;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.task.ITaskLogger;

/** What the cabinet offers to the one application that runs: its data, its control, its log. */
public final class Desk implements IApplicationData, IApplicationControl {
    /** That of the application; others are those of background tasks. */
    private static volatile Desk application;
    private static final InheritableThreadLocal<Desk> OWN = new InheritableThreadLocal<>();

    public final ITaskLogger logger = new JulLogger();
    public final Pad pad;
    public final ObserverManager observers = new ObserverManager();
    private final Station station;
    private final Runnable terminate;
    private volatile IErrorHandler errorHandler;
    private volatile double override = 1.0;

    Desk(Station station, Runnable terminate) {
        this.station = station;
        this.terminate = terminate;
        this.pad = station.pad;
    }

    public static Desk ofApplication() {
        return application;
    }

    /** The errors of asynchronous motions go to this one. */
    void leads() {
        application = this;
    }

    /** The calling thread, and those that it makes, work for this one; returns for whom it did before. */
    Desk enter() {
        Desk before = OWN.get();
        OWN.set(this);
        return before;
    }

    static void leave(Desk before) {
        OWN.set(before);
    }

    /** That of the task whose thread this is; of a thread of the cabinet that of the application. */
    public static Desk current() {
        Desk own = OWN.get();
        return own == null ? application : own;
    }

    /** An asynchronous motion has failed; called on the dispatch thread, for the application. */
    public void failed(IMotionContainer container, List<IMotionContainer> cancelled) {
        IErrorHandler handler = errorHandler;
        if (handler == null) {
            logger.error("an asynchronous motion failed and no handler is registered, the application ends: "
                    + container.getErrorMessage());
            terminate.run();
            return;
        }
        ErrorHandlingAction action = handler.handleError(station.robot, container, new ArrayList<>(cancelled));
        if (action == ErrorHandlingAction.EndApplication) {
            terminate.run();
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
            throw new IllegalArgumentException("the application override is " + value + "; it has to be in [0, 1]");
        }
        override = value;
        station.ring.setOverride(value);
    }

    @Override
    public void clipApplicationOverride(double most) {
        setApplicationOverride(Math.min(override, most));
    }

    @Override
    public void clipManualOverride(double most) {
        if (!(most >= 0.0 && most <= 1.0)) {
            throw new IllegalArgumentException("the manual override would be clipped at " + most + "; it has to be in [0, 1]");
        }
        station.plant.clipManualOverride(most);
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
        Template template = station.templates.get(name);
        if (template == null) {
            throw new PersistenceException("no template " + name);
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
            throw new PersistenceException("no frame " + path);
        }
        return found;
    }

    @Override
    public IProcessData getProcessData(final String id) {
        if (!station.processData.containsKey(id)) {
            throw new PersistenceException("no process data " + id);
        }
        return new IProcessData() {
            @Override
            @SuppressWarnings("unchecked")
            public <T> T getValue() {
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

    /** The application's log goes to java.util.logging; the host decides where that ends. */
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
