"""Questions about maps and object lists that lie in files."""
