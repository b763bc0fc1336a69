"""Records of buildings in which something is hidden, made without the workbench's code."""
