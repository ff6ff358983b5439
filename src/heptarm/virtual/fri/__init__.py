"""FRI as the cabinet does it: one session per `Controller`, sans IO, and what carries it."""
