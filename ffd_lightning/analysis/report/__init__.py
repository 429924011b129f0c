"""The page about a folder of runs: its data, and the templates that show them."""
