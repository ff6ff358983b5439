"""One arm behind a node: connection, goals, servo topics, FRI session, parameters, diagnostics, published messages."""
