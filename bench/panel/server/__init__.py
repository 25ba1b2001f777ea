"""The panel's web server: who may open it, and what passes before any page."""
