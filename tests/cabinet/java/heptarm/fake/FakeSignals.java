package heptarm.fake;

import heptarm.core.robot.SignalPort;
import heptarm.wire.IoDirection;
import heptarm.wire.IoType;
import heptarm.wire.SignalInfo;

/** Five signals without wires. */
final class FakeSignals implements SignalPort {
    private static final SignalInfo[] SIGNALS = {
        new SignalInfo("Flange.Button", IoDirection.INPUT, IoType.BOOLEAN, 0, 1),
        new SignalInfo("Flange.Lamp", IoDirection.OUTPUT, IoType.BOOLEAN, 0, 1),
        new SignalInfo("Cell.Count", IoDirection.OUTPUT, IoType.UNSIGNED, 0, 255),
        new SignalInfo("Cell.Level", IoDirection.OUTPUT, IoType.ANALOG, -10, 10),
        new SignalInfo("Cell.Offset", IoDirection.INPUT, IoType.INTEGER, -128, 127),
    };

    private final FakeFaults faults;
    private final double[] values = new double[SIGNALS.length];

    FakeSignals(FakeFaults faults) {
        this.faults = faults;
    }

    @Override
    public SignalInfo[] signals() {
        return SIGNALS;
    }

    @Override
    public void read(double[] into, int from, int count) {
        faults.read(count);
        synchronized (values) {
            System.arraycopy(values, from, into, from, count);
        }
    }

    @Override
    public void write(int[] places, double[] targets) {
        faults.command();
        synchronized (values) {
            for (int i = 0; i < places.length; i++) {
                values[places[i]] = targets[i];
            }
        }
    }
}
