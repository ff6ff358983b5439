package labs;

import java.io.FileWriter;
import java.io.IOException;
import java.io.PrintWriter;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.deviceModel.LBR;

/** Lines that the test reads. */
final class Report {
    private Report() {
    }

    static synchronized void line(IApplicationData data, String text) throws IOException {
        String file = data.getProcessData("lab.file").getValue();
        try (PrintWriter out = new PrintWriter(new FileWriter(file, true))) {
            out.println(text);
        }
    }

    static void joints(IApplicationData data, String who, LBR lbr) throws IOException {
        StringBuilder text = new StringBuilder(who);
        for (double one : lbr.getCurrentJointPosition().get()) {
            text.append(' ').append(one);
        }
        line(data, text.toString());
    }
}
