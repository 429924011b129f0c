"""Timings against named peers; run by `make bench`, described in README.md."""
