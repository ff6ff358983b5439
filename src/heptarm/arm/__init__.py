"""The arm: connecting, motions and their handles, state, the link beneath."""
