package sample;

import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.lang.reflect.Constructor;
import java.lang.reflect.Executable;
import java.lang.reflect.Field;
import java.lang.reflect.Method;
import java.lang.reflect.Modifier;
import java.lang.reflect.TypeVariable;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import java.util.regex.Matcher;
import java.util.regex.Pattern;

/**
 * Reports what of a list of classes and members an application could not use. Its input has a line for each class, "class NAME",
 * and below it its super types, "extends NAME", and its members as tests/doubles/surface.toml writes them.
 */
public final class Surface {
    private static final Pattern METHOD = Pattern.compile("(static |protected )?(?:(\\S+) )?(\\w+)\\((.*)\\)");
    private static final String[] PACKAGES = {"java.lang.", "java.util.", "java.util.concurrent.", "java.net."};

    private final Map<String, Class<?>> bySimpleName = new HashMap<>();
    private final List<String> missing = new ArrayList<>();

    public static void main(String[] arguments) throws Exception {
        Surface surface = new Surface();
        List<String> lines = new ArrayList<>();
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in, "UTF-8"));
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            lines.add(line);
        }
        surface.find(lines);
        Class<?> here = null;
        for (String line : lines) {
            if (line.startsWith("class ")) {
                here = surface.bySimpleName.get(simple(line.substring(6)));
            } else if (here != null && !surface.offers(here, line)) {
                surface.missing.add(here.getName() + ": " + line);
            }
        }
        for (String line : surface.missing) {
            System.out.println(line);
        }
    }

    private static String simple(String name) {
        return name.substring(Math.max(name.lastIndexOf('.'), name.lastIndexOf('$')) + 1);
    }

    private void find(List<String> lines) {
        for (String line : lines) {
            if (line.startsWith("class ")) {
                String name = line.substring(6);
                try {
                    bySimpleName.put(simple(name), Class.forName(name, false, Surface.class.getClassLoader()));
                } catch (ClassNotFoundException e) {
                    missing.add(name);
                }
            }
        }
    }

    private Class<?> type(String name) throws ClassNotFoundException {
        if (name.endsWith("[]")) {
            return java.lang.reflect.Array.newInstance(type(name.substring(0, name.length() - 2)), 0).getClass();
        }
        Class<?>[] primitives = {boolean.class, int.class, long.class, double.class, void.class};
        for (Class<?> primitive : primitives) {
            if (primitive.getName().equals(name)) {
                return primitive;
            }
        }
        Class<?> known = bySimpleName.get(name);
        for (int i = 0; known == null && i < PACKAGES.length; i++) {
            try {
                known = Class.forName(PACKAGES[i] + name);
            } catch (ClassNotFoundException e) {
                known = null;
            }
        }
        if (known == null) {
            throw new ClassNotFoundException("the list names no class " + name);
        }
        return known;
    }

    private boolean offers(Class<?> here, String line) throws ClassNotFoundException {
        if (!Modifier.isPublic(here.getModifiers())) {
            return false;
        }
        if (line.startsWith("extends ")) {
            return type(line.substring(8)).isAssignableFrom(here);
        }
        Matcher matcher = METHOD.matcher(line);
        return matcher.matches() ? hasMethod(here, matcher) : hasConstant(here, line);
    }

    private boolean hasConstant(Class<?> here, String line) throws ClassNotFoundException {
        String[] words = line.split(" ");
        String name = words[words.length - 1];
        Class<?> wanted = words.length == 1 ? here : type(words[1]);
        for (Field field : here.getFields()) {
            if (field.getName().equals(name) && Modifier.isStatic(field.getModifiers()) && wanted.isAssignableFrom(field.getType())) {
                return true;
            }
        }
        return false;
    }

    private boolean hasMethod(Class<?> here, Matcher wanted) throws ClassNotFoundException {
        String[] names = wanted.group(4).isEmpty() ? new String[0] : wanted.group(4).split(", ");
        Class<?>[] given = new Class<?>[names.length];
        for (int i = 0; i < names.length; i++) {
            given[i] = type(names[i]);
        }
        if ("new".equals(wanted.group(3))) {
            for (Constructor<?> one : here.getConstructors()) {
                if (takes(one, given)) {
                    return !Modifier.isAbstract(here.getModifiers());
                }
            }
            return false;
        }
        String modifier = wanted.group(1) == null ? "" : wanted.group(1).trim();
        for (Method one : "protected".equals(modifier) ? here.getDeclaredMethods() : here.getMethods()) {
            boolean visible = "protected".equals(modifier)
                    ? (one.getModifiers() & (Modifier.PROTECTED | Modifier.PUBLIC)) != 0 : true;
            if (visible && one.getName().equals(wanted.group(3)) && takes(one, given)
                    && "static".equals(modifier) == Modifier.isStatic(one.getModifiers()) && returns(here, one, wanted.group(2))) {
                return true;
            }
        }
        // an interface's toString and the like are Object's
        return here.isInterface() && "toString".equals(wanted.group(3));
    }

    private boolean returns(Class<?> here, Method method, String wanted) throws ClassNotFoundException {
        if ("any".equals(wanted) || "void".equals(wanted)) {
            return true;
        }
        boolean variable = method.getGenericReturnType() instanceof TypeVariable;
        if ("self".equals(wanted)) {
            return variable || here.isAssignableFrom(method.getReturnType());
        }
        return "T".equals(wanted) ? variable : type(wanted).isAssignableFrom(method.getReturnType());
    }

    /** Whether it can be called with values of some types. */
    private static boolean takes(Executable called, Class<?>[] given) {
        Class<?>[] formal = called.getParameterTypes();
        if (formal.length == given.length && fit(formal, given, formal.length)) {
            return true;
        }
        int fixed = formal.length - 1;
        if (!called.isVarArgs() || given.length < fixed || !fit(formal, given, fixed)) {
            return false;
        }
        for (int i = fixed; i < given.length; i++) {
            if (!formal[fixed].getComponentType().isAssignableFrom(given[i])) {
                return false;
            }
        }
        return true;
    }

    private static boolean fit(Class<?>[] formal, Class<?>[] given, int count) {
        for (int i = 0; i < count; i++) {
            if (!formal[i].isAssignableFrom(given[i])) {
                return false;
            }
        }
        return true;
    }
}
