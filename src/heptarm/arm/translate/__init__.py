"""Values to messages of the protocol and back, and nothing else: no socket, no thread, no connection.

One module per kind of value. `fields` copies what both sides call alike, so that the others hold only what differs.
What a translation has to look up, such as signals or the robot, is passed in as values.
"""
