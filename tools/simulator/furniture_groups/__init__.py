"""Groups of furniture that are used together, each laid out in its own frame before it is placed in a room."""
