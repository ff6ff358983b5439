package com.kuka.roboticsAPI.annotations;

import java.util.Set;
import java.util.concurrent.ConcurrentHashMap;

/** Lists the applications that resume automatically after a stop. Injected. */
public class AutomaticResumeManager implements IAutomaticResumeFunction {
    private final Set<String> enabled = ConcurrentHashMap.newKeySet();

    @Override
    public void enableApplicationResuming(String application) {
        enabled.add(application);
    }

    @Override
    public void disableApplicationResuming(String application) {
        enabled.remove(application);
    }

    /** Whether an application may resume, by its full or its simple name; for the simulation. */
    public boolean mayResume(Class<?> application) {
        return enabled.contains(application.getName()) || enabled.contains(application.getSimpleName())
                || enabled.contains(application.getSimpleName() + ".class");
    }
}
