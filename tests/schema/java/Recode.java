import java.io.BufferedReader;
import java.io.InputStreamReader;

import heptarm.wire.Message;
import heptarm.wire.Messages;
import heptarm.wire.Violation;
import heptarm.wire.WireException;

/** Reads "type hex" lines; answers "hex verdict": the body written again, and ok or code and path of the first violation. */
public final class Recode {
    private Recode() {
    }

    public static void main(String[] arguments) throws Exception {
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in, "US-ASCII"));
        StringBuilder out = new StringBuilder();
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            String[] parts = line.split(" ", -1);
            byte[] body = bytes(parts[1]);
            try {
                Message message = Messages.read(Integer.parseInt(parts[0]), body, 0, body.length);
                out.append(message == null ? "unknown" : hex(message.body()) + " " + verdict(message)).append('\n');
            } catch (WireException e) {
                out.append("undecodable\n");
            }
        }
        System.out.print(out);
    }

    private static String verdict(Message message) {
        try {
            message.validate("");
            return "ok";
        } catch (Violation e) {
            return e.code + ":" + e.parameter;
        }
    }

    private static byte[] bytes(String hex) {
        byte[] data = new byte[hex.length() / 2];
        for (int i = 0; i < data.length; i++) {
            data[i] = (byte) Integer.parseInt(hex.substring(2 * i, 2 * i + 2), 16);
        }
        return data;
    }

    private static String hex(byte[] data) {
        StringBuilder text = new StringBuilder();
        for (byte b : data) {
            text.append(String.format("%02x", b));
        }
        return text.toString();
    }
}
