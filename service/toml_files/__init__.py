"""The files in which engineers describe buildings and models."""
