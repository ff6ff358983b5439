package heptarm.core;

/** Text of clients, made safe to show and to log. The Python side removes the same characters. */
public final class PrintableText {
    private PrintableText() {
    }

    /** One line of text without control characters, invisible format characters and unpaired surrogates. */
    public static String of(String text) {
        StringBuilder kept = new StringBuilder(text.length());
        for (int i = 0; i < text.length();) {
            int c = text.codePointAt(i);
            i += Character.charCount(c);
            switch (Character.getType(c)) {
                case Character.CONTROL:
                    if (c == '\n' || c == '\t') {
                        kept.append(' ');
                    }
                    break;
                case Character.LINE_SEPARATOR:
                case Character.PARAGRAPH_SEPARATOR:
                    kept.append(' ');
                    break;
                case Character.FORMAT:
                case Character.SURROGATE:
                    break;
                default:
                    kept.appendCodePoint(c);
            }
        }
        return kept.toString().trim();
    }
}
