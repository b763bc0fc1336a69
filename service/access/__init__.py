"""Access: roles, keys, logins and the audit trail."""
