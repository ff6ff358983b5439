"""Recordings: what the arm does, written to a file and read back.

Here live the layout of a recording's messages, its file, the recorder's thread, the feed of a simulated camera, the
black box, and what reads, plots and converts a recording. Data come in as pushed bodies of states, as cycles of FRI
sessions, as entries of the journal that the connection keeps and as pictures of the camera's process; they go out as a
file in the MCAP format, which other tools open as well. Nothing here sends anything to the cabinet.
"""
