"""Viewers of other people, fed with what an arm reports while it does.

Here live the live view and what it sends to the rerun viewer: the arm's shapes once, then the transforms of its joints,
its signals and its events. Data come in as the recorder's, from the same queues and journal; they go out to a viewer
or to a file of its format. The panel is a page of our own, and plots of recordings are in `record`.
"""
