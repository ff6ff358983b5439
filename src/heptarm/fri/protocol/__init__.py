"""Wire format of FRI, versions 1.11 to 2.7, as pure functions of bytes.

`messages` has the values, `codec` the strict codec for all messages, `fast_codec` the templates of the 1 kHz path.
"""
