"""Training of the embedded networks on rendered houses: PyTorch on the CPU, with the extra `train`."""
