"""Wire format of FRI, versions 1.11 to 2.7, as pure functions of bytes.

`messages` has the values, `codec` the controller's side of the codec; the client's side is native/fri_message.c.
"""
