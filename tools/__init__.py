"""`placegraph <name>`: one module per command."""
