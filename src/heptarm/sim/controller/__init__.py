"""The motion controller: which command runs, and the set-point of each millisecond.

`interpolator` is its loop; queue, servo, hand guiding, speed override, safety and conditions are its parts. Commands
and stop requests come in from any thread, set-points go out to the control law.
"""
