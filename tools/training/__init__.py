"""Training of the embedded networks on views of procedural houses: PyTorch on the CPU, with the extra `train`."""
