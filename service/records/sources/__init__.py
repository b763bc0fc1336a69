"""Sources of files: monitoring servers, archives and folders."""
