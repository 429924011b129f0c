"""Building blocks that categories share, and families of theirs that fill a file."""
