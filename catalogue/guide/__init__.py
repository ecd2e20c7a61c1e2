"""Guides on their finite motion: traced, fitted, laid, measured; nothing here knows of a request or a database."""
