"""The page that `analysis.report` fills: its frame, style, script, and fragments of HTML."""
