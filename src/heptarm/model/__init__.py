"""The arm as mathematics: kinematics, inverse kinematics with redundancy, dynamics. Needs no connection."""
