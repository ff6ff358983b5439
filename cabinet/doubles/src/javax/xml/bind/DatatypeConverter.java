package javax.xml.bind;

import java.math.BigDecimal;
import java.math.BigInteger;
import java.util.Base64;
import java.util.Calendar;
import java.util.GregorianCalendar;

import javax.xml.datatype.DatatypeConfigurationException;
import javax.xml.datatype.DatatypeFactory;

/** Text forms of XML Schema's simple types; part of Java 6's library, and of no newer one. */
public final class DatatypeConverter {
    private static final char[] DIGITS = "0123456789ABCDEF".toCharArray();

    private DatatypeConverter() {
    }

    public static byte[] parseHexBinary(String text) {
        if (text.length() % 2 != 0) {
            throw new IllegalArgumentException("hexBinary must have an even number of digits, got " + text.length());
        }
        byte[] bytes = new byte[text.length() / 2];
        for (int i = 0; i < bytes.length; i++) {
            int high = Character.digit(text.charAt(2 * i), 16);
            int low = Character.digit(text.charAt(2 * i + 1), 16);
            if (high < 0 || low < 0) {
                throw new IllegalArgumentException("hexBinary must consist of the digits 0 to F, got " + text);
            }
            bytes[i] = (byte) (16 * high + low);
        }
        return bytes;
    }

    public static String printHexBinary(byte[] bytes) {
        StringBuilder text = new StringBuilder(2 * bytes.length);
        for (byte one : bytes) {
            text.append(DIGITS[one >> 4 & 15]).append(DIGITS[one & 15]);
        }
        return text.toString();
    }

    public static byte[] parseBase64Binary(String text) {
        return Base64.getMimeDecoder().decode(text);
    }

    public static String printBase64Binary(byte[] bytes) {
        return Base64.getEncoder().encodeToString(bytes);
    }

    public static String parseString(String text) {
        return text;
    }

    public static String printString(String text) {
        return text;
    }

    public static boolean parseBoolean(String text) {
        String trimmed = text.trim();
        return trimmed.equals("true") || trimmed.equals("1");
    }

    public static String printBoolean(boolean value) {
        return String.valueOf(value);
    }

    public static byte parseByte(String text) {
        return Byte.parseByte(unsigned(text));
    }

    public static String printByte(byte value) {
        return String.valueOf(value);
    }

    public static short parseShort(String text) {
        return Short.parseShort(unsigned(text));
    }

    public static String printShort(short value) {
        return String.valueOf(value);
    }

    public static int parseUnsignedShort(String text) {
        return parseInt(text);
    }

    public static String printUnsignedShort(int value) {
        return String.valueOf(value);
    }

    public static int parseInt(String text) {
        return Integer.parseInt(unsigned(text));
    }

    public static String printInt(int value) {
        return String.valueOf(value);
    }

    public static long parseUnsignedInt(String text) {
        return parseLong(text);
    }

    public static String printUnsignedInt(long value) {
        return String.valueOf(value);
    }

    public static long parseLong(String text) {
        return Long.parseLong(unsigned(text));
    }

    public static String printLong(long value) {
        return String.valueOf(value);
    }

    public static BigInteger parseInteger(String text) {
        return new BigInteger(unsigned(text));
    }

    public static String printInteger(BigInteger value) {
        return value.toString();
    }

    public static BigDecimal parseDecimal(String text) {
        return new BigDecimal(text.trim());
    }

    public static String printDecimal(BigDecimal value) {
        return value.toPlainString();
    }

    public static float parseFloat(String text) {
        return (float) parseDouble(text);
    }

    public static String printFloat(float value) {
        return Float.isInfinite(value) ? printDouble(value) : String.valueOf(value);
    }

    public static double parseDouble(String text) {
        String trimmed = text.trim();
        if (trimmed.equals("INF")) {
            return Double.POSITIVE_INFINITY;
        }
        return trimmed.equals("-INF") ? Double.NEGATIVE_INFINITY : Double.parseDouble(trimmed);
    }

    public static String printDouble(double value) {
        return String.valueOf(value).replace("Infinity", "INF");
    }

    public static Calendar parseDateTime(String text) {
        return factory().newXMLGregorianCalendar(text.trim()).toGregorianCalendar();
    }

    public static Calendar parseDate(String text) {
        return parseDateTime(text);
    }

    public static Calendar parseTime(String text) {
        return parseDateTime(text);
    }

    public static String printDateTime(Calendar value) {
        GregorianCalendar calendar = new GregorianCalendar(value.getTimeZone());
        calendar.setTimeInMillis(value.getTimeInMillis());
        return factory().newXMLGregorianCalendar(calendar).toXMLFormat();
    }

    private static DatatypeFactory factory() {
        try {
            return DatatypeFactory.newInstance();
        } catch (DatatypeConfigurationException e) {
            throw new IllegalStateException("this Java has no javax.xml.datatype", e);
        }
    }

    private static String unsigned(String text) {
        String trimmed = text.trim();
        return trimmed.startsWith("+") ? trimmed.substring(1) : trimmed;
    }
}
