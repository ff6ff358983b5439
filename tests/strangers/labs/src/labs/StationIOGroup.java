package labs;

import javax.inject.Inject;
import javax.inject.Singleton;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;

/** As WorkVisual exports a group without its device. */
@Singleton
public class StationIOGroup extends AbstractIOGroup {
    @Inject
    public StationIOGroup(Controller controller) {
        super(controller, "Station");
        addMockedInput("Order", IOTypes.UNSIGNED_INTEGER, 4, 0);
        addMockedInput("Start", IOTypes.BOOLEAN, 1, false);
        addDigitalOutput("Done", IOTypes.BOOLEAN, 1);
        addDigitalOutput("Step", IOTypes.UNSIGNED_INTEGER, 4);
    }

    public boolean getStart() {
        return getBooleanIOValue("Start", false);
    }

    public void setStart(Boolean value) {
        setMockedInput("Start", value);
    }

    public Integer getOrder() {
        return getNumberIOValue("Order", false).intValue();
    }

    public void setOrder(Integer value) {
        setMockedInput("Order", value);
    }

    public void setDone(Boolean value) {
        setDigitalOutput("Done", value);
    }

    public void setStep(Integer value) {
        setDigitalOutput("Step", value);
    }
}
