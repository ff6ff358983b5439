"""Client's side of an FRI session without IO: datagrams and times in, answers and events out.

`session` tracks the state of the controller, `answers` builds the answers, `statistics` counts and measures.
"""
