package com.kuka.generated.ioAccess;

import javax.inject.Inject;
import javax.inject.Singleton;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;

/** The signals of the station, in the shape in which WorkVisual exports a group. */
@Singleton
public class StationIOGroup extends AbstractIOGroup {
    @Inject
    public StationIOGroup(Controller controller) {
        super(controller, "Station");

        addInput("Start", IOTypes.BOOLEAN, 1);
        addInput("Order", IOTypes.UNSIGNED_INTEGER, 8);
        addInput("Pressure", IOTypes.ANALOG, 16, 0.0, 10.0);
        addDigitalOutput("Busy", IOTypes.BOOLEAN, 1);
        addDigitalOutput("Done", IOTypes.UNSIGNED_INTEGER, 8);
        addAnalogOutput("Valve", IOTypes.ANALOG, 16, 0.0, 10.0);
    }

    public boolean getStart() {
        return getBooleanIOValue("Start", false);
    }

    public java.lang.Long getOrder() {
        return getNumberIOValue("Order", false).longValue();
    }

    public double getPressure() {
        return getAnalogIOValue("Pressure", false);
    }

    public boolean getBusy() {
        return getBooleanIOValue("Busy", true);
    }

    public void setBusy(java.lang.Boolean value) {
        setDigitalOutput("Busy", value);
    }

    public java.lang.Long getDone() {
        return getNumberIOValue("Done", true).longValue();
    }

    public void setDone(java.lang.Long value) {
        setDigitalOutput("Done", value);
    }

    public double getValve() {
        return getAnalogIOValue("Valve", true);
    }

    public void setValve(double value) {
        setAnalogOutput("Valve", value);
    }
}
