"""Pick and place with a gripper over Modbus TCP: a driver for pymodbus, and a simulated device that it drives here."""

import asyncio
import os
import threading
import time

import heptarm as ha

try:
    from pymodbus.client import ModbusTcpClient
    from pymodbus.pdu import ModbusPDU
    from pymodbus.server import ModbusTcpServer
    from pymodbus.simulator import DataType, SimData, SimDevice
except ImportError:
    raise SystemExit("this example needs the package pymodbus: pip install 'pymodbus>=3.16'") from None

# Registers of the device. Another gripper has other ones: they are in its manual.
COMMAND, FORCE, STATUS, WIDTH = range(
    4
)  # command; force [N]; bits, see below; opening of the fingers [0.1 mm]
STAY, OPEN, CLOSE = range(3)
BUSY, IS_OPEN, HOLDS, FAULT = 1, 2, 4, 8


class ModbusGripper:
    """A gripper of the protocol `ha.Gripper`, with the registers above.

    Args:
        host, port: of the device.
        force: of the fingers [N].
        timeout: longest time for opening or closing [s].
    """

    def __init__(self, host: str, port: int = 502, *, force: float = 30.0, timeout: float = 3.0) -> None:
        self._name, self._timeout = f"the gripper at {host}:{port}", timeout
        self._client = ModbusTcpClient(host, port=port, timeout=1.0)
        if not self._client.connect():
            raise ha.ConnectFailed(f"{self._name} does not answer", hint="check its address and its cable")
        self._write(FORCE, round(force))

    def open(self) -> None:
        """Open it, and wait until it is open."""
        self._move(OPEN, IS_OPEN)

    def close(self) -> None:
        """Close it, and wait until it is closed or holds something."""
        self._move(CLOSE, 0)

    @property
    def is_open(self) -> bool:
        """Whether it is open."""
        return bool(self._read(STATUS) & IS_OPEN)

    @property
    def holds_something(self) -> bool:
        """Whether something is between its closed fingers."""
        return bool(self._read(STATUS) & HOLDS)

    @property
    def width(self) -> float:
        """Opening of the fingers [m]."""
        return self._read(WIDTH) * 1e-4

    def disconnect(self) -> None:
        """Close the connection; the fingers stay as they are."""
        self._client.close()

    def _move(self, command: int, wanted: int) -> None:
        self._write(COMMAND, command)
        deadline = time.monotonic() + self._timeout
        while True:
            status = self._read(STATUS)
            if status & FAULT:
                raise ha.HeptarmError(f"{self._name} reports a fault", hint="see its manual")
            if not status & BUSY and status & wanted == wanted:
                return
            if time.monotonic() > deadline:
                raise ha.Timeout(f"{self._name} took longer than {self._timeout:g} s", hint="check its power")
            time.sleep(0.02)

    def _read(self, register: int) -> int:
        return self._checked(self._client.read_holding_registers(register)).registers[0]

    def _write(self, register: int, value: int) -> None:
        self._checked(self._client.write_register(register, value))

    def _checked(self, answer: ModbusPDU) -> ModbusPDU:
        if answer.isError():
            raise ha.ConnectionLost(f"{self._name} answers {answer}", hint="check its registers")
        return answer


class SimulatedGripper:
    """A device with these registers on this computer: fingers that move, and a part between them.

    Args:
        part: width of what is between the fingers [0.1 mm]; 0: nothing.
    """

    STROKE, SPEED = 800, 2000  # [0.1 mm], [0.1 mm/s]

    def __init__(self, part: int = 0) -> None:
        self.part = part
        self._registers = [STAY, 0, 0, 0]
        self._width, self._goal, self._seen = float(self.STROKE), self.STROKE, time.monotonic()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self.port = asyncio.run_coroutine_threadsafe(self._serve(), self._loop).result(10.0)

    async def _serve(self) -> int:
        data = SimData(0, values=self._registers, datatype=DataType.REGISTERS)
        self._server = ModbusTcpServer(
            SimDevice(1, simdata=[data], action=self._access), address=("127.0.0.1", 0)
        )
        await self._server.listen()
        assert isinstance(self._server.transport, asyncio.Server)
        return int(self._server.transport.sockets[0].getsockname()[1])

    async def _access(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        written: list[int] | list[bool] | None,
    ) -> None:
        """Called by the server with every request, before it is answered."""
        now = time.monotonic()
        step, self._seen = self.SPEED * (now - self._seen), now
        if written is not None and address == COMMAND:
            self._goal = (
                self.STROKE if written[0] == OPEN else self.part if written[0] == CLOSE else self._goal
            )
        self._width += max(-step, min(step, self._goal - self._width))
        status = BUSY if self._width != self._goal else 0
        status |= IS_OPEN if self._width == self.STROKE else 0
        status |= HOLDS if self.part and self._width == self.part else 0
        registers[STATUS - start], registers[WIDTH - start] = status, round(self._width)

    def close(self) -> None:
        """End it."""
        asyncio.run_coroutine_threadsafe(self._server.shutdown(), self._loop).result(10.0)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


TOOL = ha.Tool("modbus-gripper", mass=0.9, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.15))
PART = ha.Workpiece("block", mass=0.2)
ABOVE = 0.08  # height above the table from which the arm comes down [m]


def place(arm: ha.Arm, gripper: ha.Gripper, y: float) -> None:
    """Pick the part below the tool, and put it down beside its place."""
    arm.move(ha.lin_rel(z=-ABOVE, frame="base", speed_mps=0.2))
    gripper.close()
    assert gripper.holds_something, "there is no part"
    with arm.attached(PART):
        arm.move(ha.lin_rel(z=ABOVE, frame="base", speed_mps=0.2))
        arm.move(ha.lin_rel(y=y, frame="base", speed_mps=0.3))
        arm.move(ha.lin_rel(z=-ABOVE, frame="base", speed_mps=0.2))
    gripper.open()
    arm.move(ha.lin_rel(z=ABOVE, frame="base", speed_mps=0.2))


simulated = None
if "MODBUS_GRIPPER" in os.environ:  # ADDRESS:PORT of a real one
    host, _, port = os.environ["MODBUS_GRIPPER"].partition(":")
else:
    simulated = SimulatedGripper(part=400)
    host, port = "127.0.0.1", str(simulated.port)

gripper = ModbusGripper(host, int(port or 502))
try:
    with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14"), watchdog=2.0) as arm, arm.tool(TOOL):
        arm.move(ha.ptp(ha.deg(0, 30, 0, -80, 0, 70, 0)), speed=0.4)
        gripper.open()
        for y in (0.2, -0.2):
            place(arm, gripper, y)
            print(f"placed, fingers at {1e3 * gripper.width:.1f} mm, tool at y = {arm.pose().xyz[1]:.3f} m")
        if simulated is not None:
            simulated.part = 0
            gripper.close()
            print(
                f"closed on nothing: {1e3 * gripper.width:.1f} mm, holds something: {gripper.holds_something}"
            )
            assert not gripper.holds_something
finally:
    gripper.disconnect()
    if simulated is not None:
        simulated.close()
