"""The isolation layer's motion, and its equivalent stiffness and damping."""
