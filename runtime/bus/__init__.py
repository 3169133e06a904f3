"""The bus between processes: a Zenoh session, and the flow control on top of it."""
