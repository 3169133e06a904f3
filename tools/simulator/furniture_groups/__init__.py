"""Groups of furniture that is used together, each drafted in a frame of its own before it finds its place in a room."""
