"""Pages from records: one self-contained HTML file, or the same text as Markdown."""
