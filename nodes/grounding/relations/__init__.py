"""One relation per module, each exporting RELATION."""
