package com.kuka.roboticsAPI.geometricModel.math;

/** An immutable rigid transformation: millimetres; R = Rz(alpha) Ry(beta) Rx(gamma). */
public final class Transformation implements ITransformation {
    public static final Transformation IDENTITY = ofRad(0, 0, 0, 0, 0, 0);

    private final double[][] r;
    private final double x;
    private final double y;
    private final double z;

    private Transformation(double x, double y, double z, double[][] r) {
        this.x = x;
        this.y = y;
        this.z = z;
        this.r = r;
    }

    public static Transformation ofRad(double x, double y, double z, double a, double b, double c) {
        double ca = Math.cos(a);
        double sa = Math.sin(a);
        double cb = Math.cos(b);
        double sb = Math.sin(b);
        double cc = Math.cos(c);
        double sc = Math.sin(c);
        return new Transformation(x, y, z, new double[][] {
            {ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc},
            {sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc},
            {-sb, cb * sc, cb * cc}});
    }

    public static Transformation ofDeg(double x, double y, double z, double a, double b, double c) {
        return ofRad(x, y, z, Math.toRadians(a), Math.toRadians(b), Math.toRadians(c));
    }

    public static Transformation ofTranslation(double x, double y, double z) {
        return new Transformation(x, y, z, IDENTITY.r);
    }

    public static Transformation of(Vector translation, MatrixRotation rotation) {
        return new Transformation(translation.getX(), translation.getY(), translation.getZ(), rotation.e);
    }

    public static Transformation of(Vector translation, Rotation rotation) {
        return of(translation, rotation.matrix());
    }

    /** The same rotation with another translation. */
    public Transformation withTranslation(Vector translation) {
        return of(translation, getRotationMatrix());
    }

    public Transformation withTranslation(double newX, double newY, double newZ) {
        return withTranslation(Vector.of(newX, newY, newZ));
    }

    public Transformation withRotationRad(double a, double b, double c) {
        return withRotation(Rotation.ofRad(a, b, c));
    }

    /** The same translation with another rotation. */
    public Transformation withRotation(Rotation rotation) {
        return of(Vector.of(x, y, z), rotation);
    }

    /** Of any transformation. */
    public static Transformation of(ITransformation other) {
        return other instanceof Transformation ? (Transformation) other
                : ofRad(other.getX(), other.getY(), other.getZ(), other.getAlphaRad(), other.getBetaRad(), other.getGammaRad());
    }

    /** The composition: this transformation, then the other in its frame. */
    public Transformation compose(ITransformation next) {
        Transformation o = of(next);
        double[][] product = new double[3][3];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                product[i][j] = r[i][0] * o.r[0][j] + r[i][1] * o.r[1][j] + r[i][2] * o.r[2][j];
            }
        }
        return new Transformation(x + r[0][0] * o.x + r[0][1] * o.y + r[0][2] * o.z,
                y + r[1][0] * o.x + r[1][1] * o.y + r[1][2] * o.z, z + r[2][0] * o.x + r[2][1] * o.y + r[2][2] * o.z, product);
    }

    public Transformation invert() {
        double[][] t = new double[3][3];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                t[i][j] = r[j][i];
            }
        }
        return new Transformation(-(t[0][0] * x + t[0][1] * y + t[0][2] * z), -(t[1][0] * x + t[1][1] * y + t[1][2] * z),
                -(t[2][0] * x + t[2][1] * y + t[2][2] * z), t);
    }

    public MatrixRotation getRotationMatrix() {
        return MatrixRotation.of(new Matrix(r));
    }

    @Override
    public double getX() {
        return x;
    }

    @Override
    public double getY() {
        return y;
    }

    @Override
    public double getZ() {
        return z;
    }

    @Override
    public double getAlphaRad() {
        return level() ? Math.atan2(-r[0][1], r[1][1]) : Math.atan2(r[1][0], r[0][0]);
    }

    @Override
    public double getBetaRad() {
        return Math.atan2(-r[2][0], Math.hypot(r[0][0], r[1][0]));
    }

    @Override
    public double getGammaRad() {
        return level() ? 0.0 : Math.atan2(r[2][1], r[2][2]);
    }

    /** Gimbal lock: only the sum of alpha and gamma is determined; gamma is set to 0. */
    private boolean level() {
        return Math.hypot(r[0][0], r[1][0]) < 1e-12;
    }

    @Override
    public String toString() {
        return String.format("[X=%.2f Y=%.2f Z=%.2f A=%.4f B=%.4f C=%.4f]", x, y, z, getAlphaRad(), getBetaRad(), getGammaRad());
    }
}
