"""Text, tables and charts as documents: at a terminal, as Markdown, HTML, PDF and pictures."""
