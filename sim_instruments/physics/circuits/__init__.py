"""The motor's electrical circuits as they are wired and driven."""
