package com.kuka.flexfellow;

import com.kuka.roboticsAPI.controllerModel.Controller;

import heptarm.doubles.runtime.NotModelled;

/** The mobile station flexFELLOW; not simulated. */
public abstract class AbstractFlexFellow {
    protected AbstractFlexFellow(Controller controller, String name) {
        throw new NotModelled("the flexFELLOW; leave its object out");
    }
}
