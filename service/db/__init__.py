"""The database: connections, migrations, leases, blobs, encryption, and parts that all tables and queries share."""
