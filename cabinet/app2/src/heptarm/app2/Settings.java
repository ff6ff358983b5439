package heptarm.app2;

/**
 * Settings of heptarm on a Sunrise 2.x cabinet, where it is unknown how an application reads process data: change them here and
 * synchronize. A system property of the same name comes first.
 */
final class Settings {
    private static final String[][] VALUES = {
        {"heptarm.robot", "LBR_Med_7_R800"},
        {"heptarm.port", "30001"},
        {"heptarm.datagrams", "1"},
        {"heptarm.bind", "0.0.0.0"},
        {"heptarm.key", ""},
        {"heptarm.allow", ""},
        {"heptarm.heartbeat", "0.5"},
        {"heptarm.max_rate", "500.0"},
        {"heptarm.io", ""},
    };

    private Settings() {
    }

    static String text(String name) {
        for (String[] entry : VALUES) {
            if (entry[0].equals(name)) {
                return System.getProperty(name, entry[1]);
            }
        }
        throw new IllegalArgumentException("heptarm has no setting " + name);
    }

    static double number(String name) {
        String text = text(name);
        try {
            return Double.parseDouble(text);
        } catch (NumberFormatException e) {
            throw new IllegalArgumentException("the setting " + name + " must be a number, got " + text, e);
        }
    }
}
