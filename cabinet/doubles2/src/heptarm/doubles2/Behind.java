package heptarm.doubles2;

import com.kuka.geometry.Frame;
import com.kuka.math.geometry.Transformation;
import com.kuka.math.geometry.Vector3D;

import heptarm.doubles.runtime.Station;

/** Values of the doubles for 1.x, on which those for 2.x stand, and back. */
public final class Behind {
    private Behind() {
    }

    public static Transformation transformation(heptarm.sunrise1.roboticsAPI.geometricModel.math.Transformation from) {
        return Transformation.ofRad(from.getX(), from.getY(), from.getZ(), from.getAlphaRad(), from.getBetaRad(), from.getGammaRad());
    }

    public static heptarm.sunrise1.roboticsAPI.geometricModel.math.Transformation transformation(Transformation from) {
        return heptarm.sunrise1.roboticsAPI.geometricModel.math.Transformation.ofRad(from.getX(), from.getY(), from.getZ(),
                from.getAlphaRad(), from.getBetaRad(), from.getGammaRad());
    }

    /** A frame in the base of the robot. */
    public static heptarm.sunrise1.roboticsAPI.geometricModel.Frame frame(Frame from) {
        return new heptarm.sunrise1.roboticsAPI.geometricModel.Frame(robot().getRootFrame(),
                transformation(from.getTransformationFromParent()));
    }

    public static heptarm.sunrise1.roboticsAPI.deviceModel.LBR robot() {
        return Station.current().robot;
    }

    public static Vector3D vector(heptarm.sunrise1.roboticsAPI.geometricModel.math.Vector from) {
        return Vector3D.of(from.getX(), from.getY(), from.getZ());
    }
}
