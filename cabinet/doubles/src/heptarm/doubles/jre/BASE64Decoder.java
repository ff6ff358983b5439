package heptarm.doubles.jre;

import java.io.IOException;
import java.util.Base64;

/** In place of the one inside old Java runtimes. */
public class BASE64Decoder {
    /** @throws IOException the text is not Base64 */
    public byte[] decodeBuffer(String text) throws IOException {
        try {
            return Base64.getMimeDecoder().decode(text);
        } catch (IllegalArgumentException e) {
            throw new IOException(e);
        }
    }
}
