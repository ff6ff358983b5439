"""The one seam to the outside world: clocks and transports."""
