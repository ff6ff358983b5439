"""FRI loop: a process that answers the controller every millisecond, and the client in the user's process.

`process` receives and sends, `cycle` (or `native`, in C) computes one answer, `shared_memory` and `telemetry` connect
both processes, `client` and `user_api` are the interface of a user's program.
"""
