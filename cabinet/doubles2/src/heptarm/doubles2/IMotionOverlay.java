package heptarm.doubles2;

/** An overlay of a motion. */
public interface IMotionOverlay {
    heptarm.sunrise1.roboticsAPI.motionModel.IMotionOverlay behind();
}
