package heptarm.wire;

/** A message of the protocol. */
public abstract class Message {
    public abstract int type();

    public abstract void write(Encoder out);

    public abstract void validate(String path) throws Violation;

    public final byte[] body() {
        Encoder out = new Encoder();
        write(out);
        return out.toBytes();
    }
}
