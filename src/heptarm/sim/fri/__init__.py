"""The controller side of FRI: one session per `Controller`, sans IO, and the server that transports it over UDP."""
