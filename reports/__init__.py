"""A finished run as table, page, PDF and controller export."""
