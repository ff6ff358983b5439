"""The twin: what a recording commands, carried out again by the virtual cabinet, and compared.

Here live the reading of commands out of a recording (`commands`), the run in the simulator (`replay`), and the
comparison of both over one time line (`comparison`). A recording comes in, a `Twin` goes out: both recordings, and
where they part. The application on the simulated cabinet is the one of the robot; nothing here knows how a motion
is executed.
"""
