"""An analysed event as a report: JSON, files of histories and figures, and a summary for the terminal."""
