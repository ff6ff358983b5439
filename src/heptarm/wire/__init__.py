"""heptarm's wire protocol, sans IO: generated codec, frames, session machine. No socket, no clock, no thread."""
