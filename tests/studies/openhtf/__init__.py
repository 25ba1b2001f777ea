"""Side by side with OpenHTF: motors a second, and what a kill leaves."""
