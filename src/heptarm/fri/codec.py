"""FRI messages to datagrams and back: `heptarm.fri.encoder` and `heptarm.fri.decoder` under one name."""

from heptarm.fri.decoder import decode_command, decode_monitoring
from heptarm.fri.encoder import encode_command, encode_monitoring

__all__ = ["decode_command", "decode_monitoring", "encode_command", "encode_monitoring"]
