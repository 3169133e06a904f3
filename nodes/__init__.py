"""One module per node; each exports NODE."""
