"""FRI loop: a process that answers the controller every millisecond, and the client in the user's process.

The loop is C (native/fri_*.c). `settings` is what it is made of, `native` and `cycle` are its seam, `process` starts
it; `shared_memory` and `telemetry` connect both processes, `client` and `user_api` are the interface of a user's
program.
"""
