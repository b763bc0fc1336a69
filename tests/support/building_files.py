"""A building file of three floors, for tests that need one but no real building."""

from pathlib import Path

SMALL = """\
code = "TOWER"
name = "a tower"
latitude = 35.5
longitude = 139.6
timezone = "Asia/Tokyo"

[[level]]
name = "pit"
role = "ground"
[[level]]
name = "slab"
role = "base"
mass = 8.0e6
mass_uncertainty = 0.05
[[level]]
name = "2F"
mass = 2.7e6
stiffness = 3.1e9
[[level]]
name = "roof"
mass = 2.3e6

[isolation]
rubber_height = 0.2
design_displacement = 0.4
moat_clearance = 0.5
[isolation.design]
k_b = 475.0e6
c_b = 6.0e6
F_y = 655.4e3
D_y = 1.5e-3

[source]
kind = "folder"
location = "records"

[[channel]]
id = "XX.TOWER.00.HNX"
level = "pit"
direction = "x"
quantity = "acceleration"
[[channel]]
id = "XX.TOWER.01.HNX"
level = "slab"
direction = "x"
quantity = "acceleration"
gain = -0.25
unit = "gal"
[[channel]]
id = "XX.TOWER.03.HNX"
level = "roof"
direction = "x"
quantity = "acceleration"
[[channel]]
id = "XX.TOWER.01.HYX"
level = "slab"
direction = "x"
quantity = "displacement"
[[channel]]
id = "XX.TOWER.01.KO"
level = "slab"
quantity = "temperature"
"""

FOLDER = Path("/records of a tower")
