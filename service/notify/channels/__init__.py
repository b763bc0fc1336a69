"""Channels of delivery: e-mail, webhooks, Alertmanager and chat services."""
