"""Motion and vertical load of the isolation layer, and its equivalent stiffness and damping."""
