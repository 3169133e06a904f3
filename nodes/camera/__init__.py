"""Sources of frames: one module per device or data set format, each exporting SOURCE."""
