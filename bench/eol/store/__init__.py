"""Where the records of motors are kept: SQLite with no set-up, PostgreSQL by a URL."""
