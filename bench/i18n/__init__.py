"""The reader's language: catalogues, and the errors that a person can put right."""
