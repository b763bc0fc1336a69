"""What every report is made of: charts, and values in the units that engineers read."""
