package heptarm.doubles.runtime;

import java.io.FileDescriptor;
import java.io.FileOutputStream;
import java.io.IOException;
import java.nio.charset.StandardCharsets;

/** Reports a program that calls System.exit, which would end everything in the JVM of a cabinet. */
public final class ExitGuard {
    private ExitGuard() {
    }

    /** When the JVM is asked to end, writes a line to the standard output of the process and ends it with exit code 1. */
    public static void install(String line) {
        Runtime.getRuntime().addShutdownHook(new Thread(() -> {
            try (FileOutputStream out = new FileOutputStream(FileDescriptor.out)) {
                out.write((line + "\n").getBytes(StandardCharsets.UTF_8));
            } catch (IOException e) {
                // nobody listens any more
            }
            Runtime.getRuntime().halt(1);
        }, "exit-guard"));
    }
}
