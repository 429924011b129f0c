"""Metrics: pure functions of arrays, a module each."""
