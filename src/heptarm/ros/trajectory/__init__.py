"""FollowJointTrajectory: goals, their check, interpolation, tolerances, and three executions (servo, spline, FRI).

`runner` decides what is commanded and how a goal ends, without threads or clocks; the executions stream it to the arm.
`tolerances` judges every goal, whichever execution moves the arm.
"""
