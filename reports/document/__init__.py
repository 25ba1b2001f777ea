"""A finished run as a document, and the document as page and PDF."""
