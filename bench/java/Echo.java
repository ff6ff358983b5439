import java.io.InputStream;
import java.io.OutputStream;
import java.net.InetAddress;
import java.net.ServerSocket;
import java.net.Socket;

/** The floor of a round trip: sends every received byte back, and does nothing else. */
public final class Echo {
    private Echo() {
    }

    public static void main(String[] arguments) throws Exception {
        ServerSocket server = new ServerSocket(0, 1, InetAddress.getByName("127.0.0.1"));
        System.out.println(server.getLocalPort());
        Socket peer = server.accept();
        peer.setTcpNoDelay(true);
        InputStream in = peer.getInputStream();
        OutputStream out = peer.getOutputStream();
        byte[] data = new byte[65536];
        int count = in.read(data);
        while (count > 0) {
            out.write(data, 0, count);
            count = in.read(data);
        }
    }
}
