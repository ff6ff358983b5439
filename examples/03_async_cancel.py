"""Await a motion in asyncio, and cancel another one while it runs."""

import asyncio
import os

import heptarm as ha


async def main() -> None:
    with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
        result = await arm.start(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
        print("first:", result.cause.value)
        handle = arm.start(ha.ptp(ha.deg(60, 30, 0, -90, 0, 60, 0)), speed=0.3)
        await asyncio.sleep(0.5)
        handle.cancel()
        print("second:", (await handle).cause.value)


asyncio.run(main())
