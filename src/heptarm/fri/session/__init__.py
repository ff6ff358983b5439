"""What an FRI session reports: `events`, and `statistics` of its messages. No socket and no clock is used here."""
