package heptarm.keys;

import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;

import heptarm.app.HeptarmApplication;
import heptarm.doubles.runtime.ApplicationServices;

/** The application with a person beside the robot, who presses the keys that a file names, one slot a line. */
public final class Operator extends HeptarmApplication {
    @Override
    public void initialize() {
        super.initialize();
        Path file = Path.of(getApplicationData().getProcessData("operator.file").getValue().toString());
        Thread person = new Thread(() -> watch(file), "operator");
        person.setDaemon(true);
        person.start();
    }

    private void watch(Path file) {
        int done = 0;
        try {
            while (System.getProperty("heptarm.port.bound") == null) {
                Thread.sleep(10);
            }
            Path partial = Path.of(file + ".part");
            Files.writeString(partial, System.getProperty("heptarm.port.bound"));
            Files.move(partial, Path.of(file + ".port"));
            while (true) {
                Thread.sleep(10);
                Object[] lines = Files.exists(file) ? Files.readString(file).lines().toArray() : new Object[0];
                for (; done < lines.length; done++) {
                    ApplicationServices.current().pad.press("heptarm", Integer.parseInt(lines[done].toString()));
                }
            }
        } catch (InterruptedException | IOException e) {
            getLogger().error("the operator has left", e);
        }
    }
}
