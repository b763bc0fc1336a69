"""An analysed event, written for people and programs."""
