"""Recover from an emergency stop during a motion: what the program may do, and what a person has to do."""

import threading

import heptarm as ha

home = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0), speed=0.5)
away = ha.ptp(ha.deg(60, 30, 0, -90, 0, 60, 0), speed=0.3)

# a private simulator, since the program also plays the person who presses the button
with ha.connect("sim://iiwa14", watchdog=2.0) as arm:
    arm.move(home)
    threading.Timer(1.0, arm.operator.fault, ["emergency_stop"]).start()
    try:
        arm.move(away)
    except ha.MotionAborted as error:
        print(f"{error.cause.name}: {error.result.text}, {len(error.history)} states before it")

    print(arm.recover())
    threading.Timer(1.0, arm.operator.clear).start()  # the person needs a moment
    print(arm.recover(timeout=60))
    print("at home again:", arm.move(home).arrived)
