"""The connection to the cabinet: targets, the TCP link with its heartbeat, requests, events, pushed states.

`connection` is what the arm's components use; `local_simulator` starts a virtual cabinet for `sim://` targets.
"""
