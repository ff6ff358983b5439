package heptarm.doubles.jre;

import java.nio.charset.StandardCharsets;
import java.util.Base64;

/** In place of the one inside old Java runtimes: lines of 76 characters. */
public class BASE64Encoder {
    private static final int LINE = 76;

    public String encode(byte[] data) {
        byte[] end = System.lineSeparator().getBytes(StandardCharsets.US_ASCII);
        return Base64.getMimeEncoder(LINE, end).encodeToString(data);
    }

    /** The same with a line end after the last line, too. */
    public String encodeBuffer(byte[] data) {
        return encode(data) + System.lineSeparator();
    }
}
