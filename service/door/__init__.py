"""What stands between the network and the application: limits, and who may come in."""
