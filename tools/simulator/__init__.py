"""A simulator: furnished multi-floor houses from a seed, rendered RGB-D frames, ground truth and questions."""
