package com.kuka.generated.ioAccess;

import javax.inject.Inject;
import javax.inject.Singleton;

import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;

/** The signals of the media flanges, for projects without an exported class of their own, which takes precedence. */
@Singleton
public class MediaFlangeIOGroup extends AbstractIOGroup {
    private static final String[] INPUTS =
            {"InputX3Pin3", "InputX3Pin4", "InputX3Pin10", "InputX3Pin13", "InputX3Pin16", "UserButton"};
    private static final String[] OUTPUTS = {"OutputX3Pin1", "OutputX3Pin2", "OutputX3Pin11", "OutputX3Pin12",
        "SwitchOffX3Voltage", "LEDBlue", "LEDRed", "LEDGreen"};

    @Inject
    public MediaFlangeIOGroup(Controller controller) {
        super(controller, "MediaFlange");
        for (String name : INPUTS) {
            addInput(name, IOTypes.BOOLEAN, 1);
        }
        for (String name : OUTPUTS) {
            addDigitalOutput(name, IOTypes.BOOLEAN, 1);
        }
    }

    public boolean getInputX3Pin3() {
        return getBooleanIOValue("InputX3Pin3", false);
    }

    public boolean getInputX3Pin4() {
        return getBooleanIOValue("InputX3Pin4", false);
    }

    public boolean getInputX3Pin10() {
        return getBooleanIOValue("InputX3Pin10", false);
    }

    public boolean getInputX3Pin13() {
        return getBooleanIOValue("InputX3Pin13", false);
    }

    public boolean getInputX3Pin16() {
        return getBooleanIOValue("InputX3Pin16", false);
    }

    public boolean getUserButton() {
        return getBooleanIOValue("UserButton", false);
    }

    public boolean getOutputX3Pin1() {
        return getBooleanIOValue("OutputX3Pin1", true);
    }

    public void setOutputX3Pin1(Boolean value) {
        setDigitalOutput("OutputX3Pin1", value);
    }

    public boolean getOutputX3Pin2() {
        return getBooleanIOValue("OutputX3Pin2", true);
    }

    public void setOutputX3Pin2(Boolean value) {
        setDigitalOutput("OutputX3Pin2", value);
    }

    public boolean getOutputX3Pin11() {
        return getBooleanIOValue("OutputX3Pin11", true);
    }

    public void setOutputX3Pin11(Boolean value) {
        setDigitalOutput("OutputX3Pin11", value);
    }

    public boolean getOutputX3Pin12() {
        return getBooleanIOValue("OutputX3Pin12", true);
    }

    public void setOutputX3Pin12(Boolean value) {
        setDigitalOutput("OutputX3Pin12", value);
    }

    public boolean getSwitchOffX3Voltage() {
        return getBooleanIOValue("SwitchOffX3Voltage", true);
    }

    public void setSwitchOffX3Voltage(Boolean value) {
        setDigitalOutput("SwitchOffX3Voltage", value);
    }

    public boolean getLEDBlue() {
        return getBooleanIOValue("LEDBlue", true);
    }

    public void setLEDBlue(Boolean value) {
        setDigitalOutput("LEDBlue", value);
    }

    public boolean getLEDRed() {
        return getBooleanIOValue("LEDRed", true);
    }

    public void setLEDRed(Boolean value) {
        setDigitalOutput("LEDRed", value);
    }

    public boolean getLEDGreen() {
        return getBooleanIOValue("LEDGreen", true);
    }

    public void setLEDGreen(Boolean value) {
        setDigitalOutput("LEDGreen", value);
    }
}
