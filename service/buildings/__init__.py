"""Buildings under watch: their descriptions, recipients and reference periods."""
