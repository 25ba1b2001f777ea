"""The panel's pages; each shows state that lives elsewhere."""
