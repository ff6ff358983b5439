package com.kuka.generated.ioAccess;

import javax.inject.Inject;
import javax.inject.Singleton;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;

/** The signals of the cell, in the shape in which WorkVisual exports a group. */
@Singleton
public class CellIOGroup extends AbstractIOGroup {
    @Inject
    public CellIOGroup(Controller controller) {
        super(controller, "Cell");
        addInput("Door", IOTypes.BOOLEAN, 1);
        addDigitalOutput("Grip", IOTypes.BOOLEAN, 1);
        addDigitalOutput("Lamp", IOTypes.BOOLEAN, 1);
        addDigitalOutput("Placed", IOTypes.UNSIGNED_INTEGER, 8);
    }

    public boolean getDoor() {
        return getBooleanIOValue("Door", false);
    }

    public boolean getGrip() {
        return getBooleanIOValue("Grip", true);
    }

    public void setGrip(Boolean value) {
        setDigitalOutput("Grip", value);
    }

    public boolean getLamp() {
        return getBooleanIOValue("Lamp", true);
    }

    public void setLamp(Boolean value) {
        setDigitalOutput("Lamp", value);
    }

    public Long getPlaced() {
        return getNumberIOValue("Placed", true).longValue();
    }

    public void setPlaced(Long value) {
        setDigitalOutput("Placed", value);
    }
}
