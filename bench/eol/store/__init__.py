"""The store of motors' records: SQLite without set-up, PostgreSQL by a URL."""
