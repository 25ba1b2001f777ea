"""GW Instek safety testers."""
